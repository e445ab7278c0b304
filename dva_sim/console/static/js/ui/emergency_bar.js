/** Bar on every page while an emergency holds a robot: who stopped which, when, and the release. */
import { html } from '../../vendor/preact.js';
import { mayRelease, robots, rowOf, rows, scene } from '../store.js';
import { act } from '../net/actions.js';
import { Icon } from './icon.js';
import { clockText } from './words.js';

/** @typedef {import('../lines.js').Thing} Thing */

/** A row for each stop: robots that the same device stopped within the same second. */
export function EmergencyBar() {
  void rows.value;
  return html`${stops().map(([text, stopped]) => html`<${Stop} key=${text} text=${text} stopped=${stopped} />`)}`;
}

/** @returns {[string, Thing[]][]} */
function stops() {
  /** @type {Map<string, Thing[]>} */
  const byText = new Map();
  for (const robot of robots.value) {
    const emergency = rowOf(robot.i)?.emergency;
    if (!emergency) continue;
    const text = `Stopped by ${emergency.by} at ${clockText(emergency.at_ms)}`;
    byText.set(text, [...(byText.get(text) ?? []), robot]);
  }
  return [...byText];
}

/** @param {{text: string, stopped: Thing[]}} props */
function Stop({ text, stopped }) {
  const labels = stopped.map((robot) => robot.label).join(', ');
  const byDriver = stopped.every((robot) => rowOf(robot.i)?.emergency?.released_by === 'drive');
  return html`<p class="warning emergency-bar"><${Icon} name="octagon-x" /><span>${text} · ${labels}
      ${byDriver && html` <span class="soft">A new start by the driver releases it.</span>`}</span>
    ${mayRelease.value && html`<button type="button" key="release" aria-label=${`Release ${labels}`}
      onClick=${() => release(stopped)}>Release</button>`}</p>`;
}

/** @param {Thing[]} stopped */
function release(stopped) {
  if (scene.peek()?.pages) act('robot_release', { robot: stopped[0].i });
  else act('release_emergency', { robots: stopped.map((robot) => robot.i) });
}
