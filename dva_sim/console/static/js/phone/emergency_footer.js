/** Emergency stop of the pages for a hand: of the robot in hand, or of all robots. */
import { html } from '../../vendor/preact.js';
import { stopRobots } from '../net/emergency.js';
import { Icon } from '../ui/icon.js';

/** @param {{robot?: import('../lines.js').Thing | null}} props */
export function EmergencyFooter({ robot }) {
  const own = robot && robot.i >= 0 ? robot : null;
  return html`<footer class="bottom">
    <p class="soft" id="whom-it-stops">${own ? `Stops ${own.label}.` : 'Stops all robots.'}</p>
    <button type="button" class="emergency" aria-describedby="whom-it-stops"
      onClick=${() => stopRobots(own ? [own.i] : 'all')}>
      <${Icon} name="octagon-x" />Emergency stop</button>
  </footer>`;
}
