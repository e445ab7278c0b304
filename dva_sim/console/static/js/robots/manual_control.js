/** Manual control at the robot itself: no messages, no session, the same limits and watchdog. */
import { html, useEffect, useLayoutEffect } from '../../vendor/preact.js';
import { connection, mayDrive, maySteer, whyStopped } from '../store.js';
import { act, driveLost } from '../net/actions.js';
import { DriveSliders } from '../drive/drive_sliders.js';
import { driveByGamepad } from '../drive/gamepad.js';
import { interrupt, interrupted, steerWith, watchInterruptions } from '../drive/hold.js';
import { driveByKeys } from '../drive/keys.js';
import { Stick } from '../drive/stick.js';
import { Station } from './station.js';
import { isInHand, myHand, windowOf } from './window.js';

/** @typedef {import('../lines.js').Thing} Thing */

/** @param {{robot: Thing}} props */
export function ManualControl({ robot }) {
  const mine = isInHand(robot.i);
  // Not after the next frame: once the page says that it is in hand, a key counts.
  useLayoutEffect(() => (mine ? steering() : undefined), [mine]);
  useEffect(() => {
    if (connection.value !== 'open' || driveLost.value) interrupt('The connection was lost.');
  }, [connection.value, driveLost.value]);
  const may = maySteer.value;
  const shown = windowOf(robot.i);
  const listens = shown?.station.state === 'listening';
  const stopped = whyStopped(robot.i);
  const isFree = !mine && !stopped && !shown?.holder && shown?.hand === null;
  const limits = { max_speed_mps: robot.max_speed_mps, max_turn_rate_radps: robot.max_turn_rate_radps };
  return html`<section class="panel controls manual" aria-label="Manual control"><h2>Manual control</h2>
    <${Station} robot=${robot} />
    <div class="buttons">
      <button type="button" class=${isFree ? 'go' : ''} disabled=${!may || mine || !listens || Boolean(stopped)} onClick=${() => take(robot.i)}>Take manual control</button>
      <button type="button" disabled=${!may || !mine} onClick=${() => act('manual_release')}>Release manual control</button>
    </div>
    <p class="hint" role="status" aria-label="Manual control">${hint(robot)}</p>
    <div class="steering"><${Stick} disabled=${!may || !mine} />
      <${DriveSliders} limits=${limits} disabled=${!may || !mine} /></div>
    <p class="keys soft">Hold <kbd>↑</kbd> <kbd>←</kbd> <kbd>→</kbd> or <kbd>W</kbd> <kbd>A</kbd> <kbd>D</kbd>,
      the stick or a slider. Letting go stops; there is no reverse.</p>
  </section>`;
}

/** @param {number} i */
async function take(i) {
  const done = await act('manual_take', { robot: i });
  if (done.ok && typeof done.hand === 'number') myHand.value = done.hand;
}

/** Steer this robot by keys and gamepad during manual control; any interruption stops it. */
function steering() {
  const ends = [steerWith('manual'), driveByKeys(), driveByGamepad(), watchInterruptions()];
  return () => {
    interrupt('');
    ends.reverse().forEach((end) => end());
  };
}

/** @param {Thing} robot */
function hint(robot) {
  const shown = windowOf(robot.i);
  if (connection.value !== 'open') return 'Not connected to the simulation. You cannot drive.';
  if (!mayDrive.value) return 'This address is view-only.';
  if (!shown) return '';
  if (isInHand(robot.i)) return interrupted.value ? `${interrupted.value} The robot was stopped. Hold again to drive.` : 'You control it manually. Hold to drive; everyone else gets the reply Busy.';
  if (shown.station.state !== 'listening') return 'The robot must be registered and listening first.';
  if (whyStopped(robot.i)) return whyStopped(robot.i);
  if (shown.hand !== null) return 'Another page controls it manually.';
  if (shown.mode !== 'Idle' && shown.mode !== 'Emergency') return `You can only take an idle robot. This one is in mode ${shown.mode}.`;
  if (shown.holder) return `${shown.holder} holds it.`;
  return 'It is free.';
}
