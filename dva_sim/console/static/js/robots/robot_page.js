/** Page of one robot: its messages, its wheels, and manual control. */
import { html, useEffect } from '../../vendor/preact.js';
import { isPast, modeOf, rowOf } from '../store.js';
import { stopRobots } from '../net/emergency.js';
import { watch } from '../net/sockets.js';
import { sinceSent } from '../net/world_time.js';
import { CameraPicture } from '../drive/camera.js';
import { Icon, ModeMark } from '../ui/icon.js';
import { clockText } from '../ui/words.js';
import { Faults } from './faults.js';
import { ManualControl } from './manual_control.js';
import { RobotLatency } from './robot_latency.js';
import { RobotLog } from './robot_log.js';
import { Sensors } from './sensors.js';
import { SideView } from './side_view.js';
import { TopView } from './top_view.js';
import { windowOf } from './window.js';

/** @typedef {import('../lines.js').Thing} Thing */

/** @param {{robot: Thing}} props */
export function RobotPage({ robot }) {
  useEffect(() => {
    watch([robot.i]);
    return () => watch([]);
  }, [robot.i]);
  return html`<main class="page robot-page" id="main" tabindex="-1">
    <${Head} robot=${robot} />
    <div class="column"><${RobotLog} robot=${robot} /><${RobotLatency} robot=${robot} /></div>
    <div class="column"><${SideView} robot=${robot} /><${TopView} robot=${robot} />
      ${!isPast.value && html`<${Sensors} robot=${robot} />`}</div>
    <div class="column">${!isPast.value && html`<${ManualControl} robot=${robot} />`}
      <section class="panel camera-panel" aria-label="Camera"><h2>Camera</h2>
        <${CameraPicture} robot=${robot} /></section>
      ${!isPast.value && html`<${Faults} robot=${robot} />`}</div>
  </main>`;
}

/** @param {{robot: Thing}} props */
function Head({ robot }) {
  const shown = windowOf(robot.i);
  const mode = modeOf(robot.i);
  const reported = shown?.watchdog_left_s ?? null;
  const left = shown && reported !== null ? Math.max(0, reported - sinceSent(shown)) : null;
  return html`<header class="robot-bar">
    <h1>${robot.label}</h1>
    <span role="status" aria-label="Mode" class="mode-status reported"><${ModeMark} mode=${mode} /> ${mode}</span>
    ${shown?.holder && html`<span class="reported">held by ${shown.holder}</span>`}
    ${!isPast.value && html`<span class="soft reported">${left === null ? 'watchdog off' : `watchdog ${left.toFixed(1)} s`}</span>`}
    <span class="gap"></span>
    <a href="#/robots">All robots</a>
    ${!isPast.value && html`<button type="button" key="stop" class="stop-one"
      onClick=${() => stopRobots([robot.i])}><${Icon} name="octagon-x" />Stop ${robot.label}</button>
    <${Reasons} robot=${robot} />`}
  </header>`;
}

/**
 * Reason why the robot is stopped; an emergency and commands that do not come are highlighted.
 * @param {{robot: Thing}} props
 */
function Reasons({ robot }) {
  const shown = windowOf(robot.i);
  if (!shown) return html`<p class="reason" role="status" aria-label="Reason">Waiting for its status …</p>`;
  const { stop_reason: stopReason, notice, link_lost: lost } = shown;
  const stop = rowOf(robot.i)?.emergency;
  const text = stop
    ? `Emergency stop by ${stop.by} at ${clockText(stop.at_ms)}: the robot stands until it is released.`
    : stopReason && `Stopped: ${stopReason}`;
  return html`<p class=${stop || lost ? 'reason reported warning' : 'reason reported'} role="status" aria-label="Reason">
    <span>${text || 'It moves.'}${notice && ` ${notice}.`}</span></p>`;
}
