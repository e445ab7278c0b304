/** Driving screen: the robot's picture over the whole screen, with the controls. */
import { html, useEffect, useMemo, useState } from '../../vendor/preact.js';
import { clock, driveOf, maySteer, rowOf, rows, scene, seat } from '../store.js';
import { act } from '../net/actions.js';
import { watch } from '../net/sockets.js';
import { placeOf } from '../map/shown.js';
import { CameraPicture } from '../drive/camera.js';
import { pictureAge } from '../drive/drawn.js';
import { driveByGamepad } from '../drive/gamepad.js';
import { driveByKeys } from '../drive/keys.js';
import { Sensing } from '../drive/sensing.js';
import { Stick } from '../drive/stick.js';
import { useEvery } from '../ui/every.js';
import { msText, plain } from '../ui/words.js';
import { choices } from './choices.js';
import { holds, isDriving, phase, phone, robot, sendCalibration, start, stop, thumb, tilts } from './drive.js';
import { WORDS, state as sensor } from './sensor.js';
import { swipes } from './swipe.js';

/** The screen. */
export function TeleoperationScreen() {
  const one = robot.value;
  const held = holds.value;
  useEffect(() => {
    if (!one || !held) return undefined;
    if (one.i >= 0) watch([one.i]);
    sendCalibration();
    return () => watch([]);
  }, [one?.i, held]);
  if (!one || !held) {
    return html`<div role="alert" class="warning"><span>You do not have permission to drive a robot yet:
      ${' '}<a href="#/authentication">Authentication</a> comes first.</span></div>`;
  }
  return html`<${Cockpit} one=${one} />`;
}

/** @param {{one: import('../lines.js').Thing}} props */
function Cockpit({ one }) {
  const handlers = useMemo(swipes, []);
  useEffect(() => {
    const ends = [driveByKeys(), driveByGamepad()];
    return () => ends.forEach((end) => end());
  }, []);
  const busy = isDriving.value;
  return html`<div class="cockpit-phone">
    <div class="surface" ...${handlers}>${one.i >= 0 && html`<${CameraPicture} robot=${one} />`}</div>
    <${Figures} one=${one} />
    <${Order} />
    ${one.i >= 0 && html`<${Sensing} robot=${one} />`}
    <div class="below">
      <p class="hint" role="status" aria-label="Doing"><${Hint} one=${one} /></p>
      ${!tilts.value && html`<div class="stick-box"><${Stick} disabled=${!maySteer.value} /></div>`}
      <div class="buttons">
        <button type="button" class=${busy ? 'big' : 'big go'} disabled=${!maySteer.value || busy || phase.value === 'stopping'}
          onClick=${start}>Start</button>
        <button type="button" class=${busy ? 'big go' : 'big'} disabled=${!maySteer.value || !busy}
          onClick=${stop}>Stop</button>
      </div>
    </div>
  </div>`;
}

/**
 * Radius and speed as in the app, and latencies.
 * @param {{one: import('../lines.js').Thing}} props
 */
function Figures({ one }) {
  const drive = seat.value?.drives.find((each) => (each.i ?? -1) === one.i);
  const [speed, turn] = drive?.command ?? [0, 0];
  const degrees = phone.value ? phone.value.radius_deg : Math.trunc((turn * 180) / Math.PI);
  const pattern = scene.value?.patterns.find((each) => each.name === drive?.pattern);
  const metres = phone.value ? phone.value.speed_mps : speed;
  return html`<div class="figures-phone reported">
    <span role="status" aria-label="Radius" aria-live="off">Radius: ${degrees}°</span>
    <span role="status" aria-label="Speed" aria-live="off">Speed: ${metres.toFixed(2)}m/s</span>
    <small><span role="status" aria-label="Pattern">${pattern?.label ?? drive?.pattern}</span>, command ${msText(drive?.command_age_ms ?? null)} old</small>
  </div>`;
}

const PHASES = /** @type {Record<string, string>} */ ({
  asking: 'Requesting the robot …',
  starting: 'Starting …',
  stopping: 'Stopping …',
});

const TELLING_S = 3; // from then on it is said how long nothing has been heard

/** Pending request, with its waiting time if it is long. @param {{what: string}} props */
function Waiting({ what }) {
  const [began] = useState(performance.now());
  useEvery(1000);
  const waited = Math.floor((performance.now() - began) / 1000);
  return waited < TELLING_S ? what : `${what} No answer for ${waited} s.`;
}

/** Next step, or the reason why the robot stands still. @param {{one: import('../lines.js').Thing}} props */
function Hint({ one }) {
  void rows.value;
  if (clock.value.paused) return 'The simulation is paused.';
  if (clock.value.held_by_lag) return 'Stopped: the simulation is behind real time.';
  if (PHASES[phase.value]) return html`<${Waiting} key=${phase.value} what=${PHASES[phase.value]} />`;
  const how = tilts.value ? 'tilt to drive' : 'hold the stick, a key or the gamepad';
  if (phase.value !== 'driving') {
    if (sensor.value === 'tap') return WORDS.tap;
    const warn = choices.value.calibrated ? '' : ' This phone is not calibrated: steering will be wrong.';
    return `Swipe up or press Start, then ${how}.${warn}`;
  }
  if (choices.value.hold && tilts.value && !thumb.value) return 'Hold your thumb on the picture and tilt.';
  const blind = Math.floor(pictureAge(one.i) / 1000);
  if (blind >= TELLING_S) {
    const silent = driveOf(one.i)?.silent_s ?? 0;
    return `No picture for ${blind} s. ${silent < TELLING_S ? 'The robot is heard.' : `Nothing of the robot for ${silent} s: it stops by itself.`}`;
  }
  const why = rowOf(one.i)?.stop_reason;
  if (!why) return 'Driving. Swipe down to stop.';
  const steady = why.startsWith('no command') && !repeats() ? ' This pipeline sends a steady tilt only once: move the phone.' : '';
  return `Stopped: ${why}.${steady}`;
}

/** True unless the phone's pipeline sends a tilt only when it has changed. */
const repeats = () => !tilts.value || scene.value?.phone?.pipelines[phone.value?.pipeline ?? '']?.send !== 'on_change';

/** Current order, with buttons to report what the driver saw there. */
function Order() {
  const order = seat.value?.order;
  if (!order) return null;
  const off = !maySteer.value;
  return html`<section class="order-phone" aria-label="Order in hand">
    <p>Event ${order.event}: ${plain(order.kind)} ${placeOf(order)}</p>
    <div class="buttons">
      <button type="button" disabled=${off} onClick=${() => act('confirm')}>Confirm</button>
      <button type="button" disabled=${off} onClick=${() => act('refute')}>Refute</button>
      <button type="button" disabled=${off} onClick=${() => act('decline')}>Decline</button>
    </div>
  </section>`;
}
