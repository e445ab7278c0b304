/** Controls to take, start, drive, stop and release; and the robot's current mode. */
import { html, signal, useEffect, useRef } from '../../vendor/preact.js';
import { clock, connection, floorMs, mayDrive, maySteer, modeOf, rowOf, rows, seat, whyStopped } from '../store.js';
import { act } from '../net/actions.js';
import { DriveSliders } from './drive_sliders.js';
import { gamepad } from './gamepad.js';
import { held, interrupted, wish } from './hold.js';
import { Stick } from './stick.js';

/** @typedef {import('../lines.js').Thing} Thing */

const LEVELS = ['teleoperation', 'missions', 'both'];
const level = signal('teleoperation');

/** @param {{robots: Thing[]}} props */
export function Controls({ robots }) {
  const may = maySteer.value;
  const drives = seat.value?.drives ?? [];
  const holds = drives.length > 0;
  const phase = seat.value?.phase ?? 'free';
  const stopped = drives.map((drive) => whyStopped(drive.i)).find(Boolean) ?? '';
  const canStart = drives.some((drive) => drive.phase === 'held' && !whyStopped(drive.i));
  const limits = {
    max_speed_mps: Math.min(...robots.map((robot) => robot.max_speed_mps || 0.5)),
    max_turn_rate_radps: Math.min(...robots.map((robot) => robot.max_turn_rate_radps || 0.52)),
  };
  return html`<section class="panel controls" aria-label="Driving">
    <div class="statuses"><span>Mode</span><${Mode} robots=${robots} />
      <label class="level"><span>Permission</span> <select aria-label="Permission level" value=${level.value} disabled=${!may || holds}
        onChange=${(/** @type {any} */ change) => (level.value = change.target.value)}>
        ${LEVELS.map((name) => html`<option key=${name} value=${name}>${name}</option>`)}</select></label></div>
    <div class="buttons" ref=${useNextButton(may ? NEXT[phase] : undefined)}>
      <button type="button" disabled=${!may || holds}
        onClick=${() => act('take', { robots: robots.map((robot) => robot.i), level: level.value })}>Take control</button>
      <button type="button" class=${phase === 'held' && canStart ? 'go' : ''} disabled=${!may || !canStart}
        onClick=${() => act('start')}>Start</button>
      <button type="button" class=${phase === 'driving' ? 'go' : ''} disabled=${!may || !holds}
        onClick=${() => act('stop')}>Stop</button>
      <button type="button" disabled=${!may || !holds} onClick=${() => act('release')}>Release control</button>
    </div>
    <p class="hint"><${Hint} holds=${holds} stopped=${canStart ? '' : stopped} /></p>
    <div class="steering"><${Stick} disabled=${!may} />
      <${DriveSliders} limits=${limits} disabled=${!may} /></div>
    <p class="keys soft">Hold <kbd>↑</kbd> <kbd>←</kbd> <kbd>→</kbd> or <kbd>W</kbd> <kbd>A</kbd> <kbd>D</kbd>,
      the stick, a slider${gamepad.value ? ' or a shoulder button of the gamepad' : ''}; <kbd>Shift</kbd> slowly. Letting go stops.</p>
  </section>`;
}

/** Index of the next button for each phase; none while a request is pending. */
const NEXT = /** @type {Record<string, number>} */ ({ free: 0, held: 1, driving: 2 });

/**
 * Move the focus to the next button when the focused one is disabled, so that keys alone suffice.
 * @param {number | undefined} next
 */
function useNextButton(next) {
  const box = useRef(/** @type {HTMLElement | null} */ (null));
  const newest = useRef(/** @type {EventTarget | null} */ (null));
  useEffect(() => {
    const note = (/** @type {FocusEvent} */ event) => (newest.current = event.target);
    document.addEventListener('focusin', note);
    return () => document.removeEventListener('focusin', note);
  }, []);
  useEffect(() => {
    const had = newest.current;
    const lost = had instanceof HTMLButtonElement && had.disabled && box.current?.contains(had);
    if (lost && next !== undefined) box.current?.querySelectorAll('button')[next].focus();
  });
  return box;
}

/** The modes of the robots on this page; announced when they change, and only then. */
function Mode(/** @type {{robots: Thing[]}} */ { robots }) {
  void rows.value;
  const text =
    robots.length === 1
      ? modeOf(robots[0].i)
      : robots.map((robot) => `${robot.label} ${modeOf(robot.i)}`).join(', ');
  return html`<span role="status" aria-label="Mode" class="mode-status reported">${text}</span>`;
}

const PHASES = /** @type {Record<string, string>} */ ({
  asking: 'Asking for control …',
  held: 'You have control. Press Start, then hold to drive.',
  driving: 'Driving: hold a key, the stick or a slider.',
  stopping: 'Stopping …',
});

/** Next step, or the reason why nothing moves. @param {{holds: boolean, stopped: string}} props */
function Hint({ holds, stopped }) {
  if (connection.value !== 'open') return 'Not connected to the simulation. You cannot drive.';
  if (!mayDrive.value) return 'This address is view-only. The address for driving is printed in the terminal where the console was started.';
  if (!maySteer.value) return 'Connecting …';
  if (clock.value.held_by_lag) return 'Stopped: the simulation is behind real time.';
  if (clock.value.paused) return 'The simulation is paused.';
  if (interrupted.value) return `${interrupted.value} The robot was stopped: press Start, then take hold again.`;
  if (stopped) return stopped;
  if (!holds) return heldByOther() || 'Take control of the robot first.';
  const phase = seat.value?.phase ?? 'free';
  const wait = Math.round(floorMs.value);
  if (phase === 'starting') return `Starting: the robot’s reply takes at least ${2 * wait} ms.`;
  if (isOnItsWay()) return `Your command takes at least ${wait} ms to reach the robot.`;
  if (held.value && phase === 'held') return 'Let go, press Start, then hold again: the robot is not accepting commands yet.';
  return PHASES[phase] ?? '';
}

/** True while a speed is requested that no robot applies yet. */
function isOnItsWay() {
  const drives = seat.value?.drives ?? [];
  const wanted = held.value && wish.value.speed > 0 && seat.value?.phase === 'driving';
  return wanted && drives.every((drive) => rowOf(drive.i)?.set_speed_mps === 0);
}

function heldByOther() {
  const row = (rows.value?.robots ?? []).find((one) => one.holder && rowOf(one.i)?.mode === 'Teleoperation');
  return row ? `${row.holder_label ?? row.holder} is driving a robot now.` : '';
}
