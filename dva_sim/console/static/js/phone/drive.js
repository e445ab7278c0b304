/**
 * A drive by phone: what may begin it, and everything that ends it.
 *
 * Whatever takes the phone out of the person's hand ends the drive for good (hidden, turned, the
 * sensor silent, the thumb lifted, the connection gone). The world ends it by itself, too, when no
 * samples come; the robot's watchdog has the last word.
 */
import { computed, effect, signal } from '../../vendor/preact.js';
import { connection, notice, robots, rowOf, rows, seat } from '../store.js';
import { act, driveLost } from '../net/actions.js';
import { engaged, interrupt, interrupted, watchInterruptions } from '../drive/hold.js';
import { choices } from './choices.js';
import { keepAwake, vibrate } from './feel.js';
import { screen } from './screens.js';
import { ask as askSensor, countSilence, isIos, silentFor, state as sensor } from './sensor.js';

const SILENT_MS = 300;
const LOOK_MS = 50;
const CONTACT = ['it is stuck against something', 'something is in its way'];

/** Whether a thumb is on the picture. */
export const thumb = signal(false);
/** Whether a start has been asked for and not been answered. */
const asking = signal(false);

export const phone = computed(() => seat.value?.phone ?? null);
export const phase = computed(() => seat.value?.phase ?? 'free');
/** Whether a robot is in this page's hands: by the phone's permission, or by the console. */
export const holds = computed(
  () => (seat.value?.drives.length ?? 0) > 0 && !['asking', 'free'].includes(phase.value),
);
/** Whether who drives is known to the DVA: as a phone, or as the console's operator. */
export const isKnown = computed(() => Boolean(phone.value?.registered) || holds.value);
export const isDriving = computed(() => ['starting', 'driving'].includes(phase.value));
/** Whether the phone is steered by tilting it: without a sensor it is by the stick. */
export const tilts = computed(
  () => choices.value.by === 'tilt' && ['live', 'looking', 'tap'].includes(sensor.value),
);

/** The robot that is held, else the one that was chosen. */
export const robot = computed(() => {
  const held = seat.value?.drives[0]?.i;
  const chosen = phone.value?.device ?? choices.value.device;
  if (held === null) return { ...STRANGER, id: chosen, label: chosen };
  return robots.value.find((one) => (held === undefined ? one.id === chosen : one.i === held)) ?? null;
});
/** A device that the DVA knows, and that is no robot of this world: nobody draws what it sees. */
const STRANGER = { i: -1, kind: 'robot', radius_m: 0, max_speed_mps: 0, max_turn_rate_radps: 0 };
/** Why nothing can be stopped; empty if it can. */
export const whyNoEmergency = computed(() => {
  if (!isKnown.value) return 'No robot yet: register first.';
  if (!robot.value) return 'No robot yet: choose one first.';
  return robot.value.i < 0 ? 'This device is not a robot of this simulation, so nothing will move.' : '';
});

/** Begin, if a robot is in hand. */
export async function start() {
  if (!holds.value || isDriving.value || asking.peek()) return;
  await askSensor(); // if it wants to be, which has to be from a tap
  const why = whyNot();
  if (why) {
    notice.value = why;
    return;
  }
  interrupted.value = '';
  asking.value = true;
  engaged.value = true;
  await sendCalibration();
  await act('start');
  asking.value = false;
}

/** Why a tilted phone cannot begin; empty if it can. */
function whyNot() {
  if (!tilts.peek()) return '';
  if (sensor.peek() === 'tap') return 'Tap Start to allow access to the motion sensor.';
  if (sensor.peek() !== 'live') return 'No motion sensor data is arriving, so driving was not started. See Calibration.';
  if (isSilent()) return `The motion sensor has been silent for ${silentText()}, so driving was not started. Tilt the phone and start again.`;
  const lifted = choices.peek().hold && !thumb.peek();
  return lifted ? 'Hold to drive is on: swipe up over the picture and keep your thumb there.' : '';
}

/** End. */
export function stop() {
  if (holds.value) act('stop');
}

/** What was chosen on this phone goes to the world; also again, where it has forgotten. */
export async function sendCalibration(force = false) {
  const kept = choices.peek();
  if (!isKnown.value || (phone.peek()?.calibrated && !force)) return null;
  if (!kept.calibrated) return null;
  return act('phone_calibrate', {
    reference_mps2: tilts.peek() ? kept.reference : null,
    speed_step_mps2: Number(kept.force),
    turn_step_mps2: Number(kept.radius),
    max_delay_s: Number(kept.delay) / 1000,
    pipeline: kept.pipeline,
    filter: kept.filter || null,
    mapping: kept.mapping,
    ios: isIos,
    ...(kept.keep && { keep: true }),
  });
}

/** From now on. */
export function keepDriveInHand() {
  watchInterruptions();
  effect(() => {
    engaged.value = isDriving.value || asking.value;
  });
  effect(() => keepAwake(engaged.value));
  let losses = 0;
  effect(() => {
    if (connection.value !== 'open' || driveLost.value !== losses) end('The link to the console was lost.');
    losses = driveLost.value;
  });
  effect(() => {
    if (screen.value !== 'teleoperation') end('You left the driving screen.');
  });
  window.setInterval(watchSensor, LOOK_MS);
  feelDrive();
}

/** Who tilts a phone whose sensor says nothing steers nothing. */
function watchSensor() {
  countSilence(LOOK_MS);
  if (engaged.peek() && tilts.peek() && isSilent()) interrupt('The motion sensor stopped sending.');
}

const isSilent = () => silentFor() > SILENT_MS;
const silentText = () => `${(silentFor() / 1000).toFixed(1)} s`;

/** Outside of the effect that notices it. @param {string} why */
const end = (why) => queueMicrotask(() => interrupt(why));

/** @param {boolean} down a thumb on the picture, or none any more */
export function press(down) {
  const was = thumb.peek();
  thumb.value = down;
  if (was && !down && choices.peek().hold && tilts.peek()) interrupt('You lifted your thumb.');
}

/** A drive is felt: its start, its end, a contact, a lost link. */
function feelDrive() {
  let before = '';
  let touched = false;
  let lost = false;
  effect(() => {
    if (phase.value === 'driving' && before !== 'driving') vibrate('start');
    if (before === 'driving' && phase.value !== 'driving') vibrate('stop');
    before = phase.value;
  });
  effect(() => {
    void rows.value;
    const touches = CONTACT.includes(rowOf(robot.value?.i ?? -1)?.stop_reason ?? '');
    if (touches && !touched && isDriving.value) vibrate('contact');
    touched = touches;
  });
  effect(() => {
    const gone = isLinkLost();
    if (gone && !lost && holds.value) vibrate('lost');
    lost = gone;
  });
}

/** Whether the robot, or the console, cannot be reached. */
export const isLinkLost = () =>
  connection.value === 'lost' || Boolean(seat.value?.alert.includes('link lost'));
