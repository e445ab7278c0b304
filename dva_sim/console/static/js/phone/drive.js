/**
 * A drive by phone: the conditions for starting it, and everything that ends it.
 *
 * Any interruption ends the drive for good (page hidden, screen turned, sensor silent, thumb lifted,
 * connection lost). The simulation also ends it when no samples arrive; the robot's watchdog is the
 * last resort.
 */
import { computed, effect, signal } from '../../vendor/preact.js';
import { connection, notice, robots, rowOf, rows, seat, whyStopped } from '../store.js';
import { act, driveLost } from '../net/actions.js';
import { engaged, interrupt, interrupted, watchInterruptions } from '../drive/hold.js';
import { choices } from './choices.js';
import { keepAwake, vibrate } from './feel.js';
import { screen } from './screens.js';
import { ask as askSensor, countSilence, isIos, silentFor, state as sensor } from './sensor.js';

const SILENT_MS = 300;
const LOOK_MS = 50;
const CONTACT = ['it is stuck against something', 'something is in its way'];

/** True while a thumb is on the picture. */
export const thumb = signal(false);
/** True while a start request is pending. */
const asking = signal(false);

export const phone = computed(() => seat.value?.phone ?? null);
export const phase = computed(() => seat.value?.phase ?? 'free');
/** True while this page holds a robot, by the phone's permission or as the console's operator. */
export const holds = computed(
  () => (seat.value?.drives.length ?? 0) > 0 && !['asking', 'free'].includes(phase.value),
);
/** True if the driver is registered with the DVA, as a phone or as the console's operator. */
export const isKnown = computed(() => Boolean(phone.value?.registered) || holds.value);
export const isDriving = computed(() => ['starting', 'driving'].includes(phase.value));
/** True if the phone steers by tilting; without a sensor it uses the stick. */
export const tilts = computed(
  () => choices.value.by === 'tilt' && ['live', 'looking', 'tap'].includes(sensor.value),
);

/** Robot currently held, else the chosen one. */
export const robot = computed(() => {
  const held = seat.value?.drives[0]?.i;
  const chosen = phone.value?.device ?? choices.value.device;
  if (held === null) return { ...STRANGER, id: chosen, label: chosen };
  return robots.value.find((one) => (held === undefined ? one.id === chosen : one.i === held)) ?? null;
});
/** Stand-in for a device of the DVA that is not a robot of this simulation: it has no camera picture. */
const STRANGER = { i: -1, kind: 'robot', radius_m: 0, max_speed_mps: 0, max_turn_rate_radps: 0 };
/** Start driving, if this page holds a robot. */
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

/** Reason why a drive by tilting cannot start; empty if it can. */
function whyNot() {
  const stopped = whyStopped(robot.peek()?.i ?? -1);
  if (stopped || !tilts.peek()) return stopped;
  if (sensor.peek() === 'tap') return 'Tap Start to allow access to the motion sensor.';
  if (sensor.peek() !== 'live') return 'No motion sensor data is arriving, so driving was not started. See Calibration.';
  if (isSilent()) return `The motion sensor has been silent for ${silentText()}, so driving was not started. Tilt the phone and start again.`;
  const lifted = choices.peek().hold && !thumb.peek();
  return lifted ? 'Hold to drive is on: swipe up over the picture and keep your thumb there.' : '';
}

/** Stop driving. */
export function stop() {
  if (holds.value) act('stop');
}

/** Send the settings of this phone to the simulation, unless it already has them. */
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

/** Start watching for everything that ends a drive. */
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

/** Interrupt a drive by tilting when the sensor falls silent. */
function watchSensor() {
  countSilence(LOOK_MS);
  if (engaged.peek() && tilts.peek() && isSilent()) interrupt('The motion sensor stopped sending.');
}

const isSilent = () => silentFor() > SILENT_MS;
const silentText = () => `${(silentFor() / 1000).toFixed(1)} s`;

/** Interrupt the drive, outside the effect that detects the cause. @param {string} why */
const end = (why) => queueMicrotask(() => interrupt(why));

/** @param {boolean} down true when a thumb touches the picture, false when it is lifted */
export function press(down) {
  const was = thumb.peek();
  thumb.value = down;
  if (was && !down && choices.peek().hold && tilts.peek()) interrupt('You lifted your thumb.');
}

/** Vibrate at the start and end of a drive, at a contact and when the link is lost. */
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

const SILENT_ROBOT_S = 3;

/** True if the robot or the console cannot be reached; an alert of before counts until the robot is heard again. */
export const isLinkLost = () => {
  const silent = seat.value?.drives[0]?.silent_s ?? Infinity;
  return connection.value === 'lost' || (Boolean(seat.value?.alert.includes('link lost')) && silent > SILENT_ROBOT_S);
};
