/** Header above each picture: the robot, its pattern, and counts of its commands. */
import { html } from '../../vendor/preact.js';
import { driveOf, isAttached, modeOf, robots, rowOf, rows, seat } from '../store.js';
import { sinceSent } from '../net/world_time.js';
import { PatternSelect } from '../network/pattern_select.js';
import { chooseRobots, driven } from '../shell/route.js';
import { ModeMark } from '../ui/icon.js';

/** @param {{robot: import('../lines.js').Thing, place: number}} props */
export function RobotHead({ robot, place }) {
  void rows.value;
  return html`<div class="robot-head">
    <span class="reported"><${ModeMark} mode=${modeOf(robot.i)} /></span>
    <${RobotSelect} robot=${robot} place=${place} />
    <${PatternSelect} robot=${robot} />
    ${place === 0 && driven.value.length < 2 && html`<${BesideButton} robot=${robot} />`}
    ${place > 0 && html`<button type="button" key="remove" class="plain" aria-label=${`Remove ${robot.label} from this page`}
      title=${`Remove ${robot.label} from this page`} disabled=${isHeld()}
      onClick=${() => chooseRobots([driven.peek()[0].label])}>×</button>`}
    <${Watchdog} robot=${robot} /><${StopReason} robot=${robot} />
  </div>`;
}

/** True while this page holds a robot; others can be chosen only after its release. */
const isHeld = () => Boolean(seat.value?.drives.length);

/** @param {{robot: import('../lines.js').Thing, place: number}} props */
function RobotSelect({ robot, place }) {
  const change = (/** @type {any} */ event) => {
    const labels = driven.peek().map((one) => one.label);
    labels[place] = event.currentTarget.value;
    chooseRobots(labels);
  };
  const taken = new Set(driven.value.filter((one) => one.i !== robot.i).map((one) => one.label));
  return html`<label><span class="hidden">${place ? 'Second robot' : 'First robot'}</span>
    <select value=${robot.label} onChange=${change} disabled=${isHeld()}>
      ${robots.value
        .filter((one) => !taken.has(one.label))
        .map((one) => html`<option value=${one.label} selected=${one.i === robot.i}>${one.label}</option>`)}
    </select></label>`;
}

/** @param {{robot: import('../lines.js').Thing}} props */
function BesideButton({ robot }) {
  const other = robots.value.find((one) => one.i !== robot.i);
  if (!other) return null;
  return html`<button type="button" class="beside" disabled=${isHeld()}
    title="Drive two robots with the same input, each with its own messaging pattern"
    onClick=${() => chooseRobots([robot.label, other.label])}>Add ${other.label}</button>`;
}

/**
 * Time until the watchdog stops the robot without a command.
 * @param {{robot: import('../lines.js').Thing}} props
 */
function Watchdog({ robot }) {
  const reported = rowOf(robot.i)?.watchdog_left_s;
  if (isAttached.value) return null; // no message tells it
  if (!rows.value || reported === null || reported === undefined) return html`<span class="watchdog off reported">watchdog off</span>`;
  const left = Math.max(0, reported - sinceSent(rows.value));
  return html`<span class=${`watchdog reported ${left < 1 ? 'low' : ''}`} title="The robot stops by itself if no command arrives for this long">
    <meter min="0" max="3" value=${left} aria-label=${`Watchdog of ${robot.label}`}></meter>watchdog ${left.toFixed(1)} s</span>`;
}

/** @param {{robot: import('../lines.js').Thing}} props */
function StopReason({ robot }) {
  const row = rowOf(robot.i);
  const drive = driveOf(robot.i);
  const speed = row?.set_speed_mps ?? drive?.command[0] ?? 0;
  const name = isAttached.value ? 'Commanded' : 'Set point';
  const text = row?.stop_reason ? `Stopped: ${row.stop_reason}` : `${name} ${speed.toFixed(2)} m/s`;
  const counts = drive ? `${drive.sent} sent, ${drive.refused} refused, ${drive.timeouts} timed out` : '';
  return html`<span class="stop-reason reported">${text} <span class="soft">${counts}</span></span>`;
}
