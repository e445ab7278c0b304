/** Current values of a robot's sensors. */
import { html } from '../../vendor/preact.js';
import { valueText } from '../ui/sensor_text.js';
import { plain } from '../ui/words.js';
import { windowOf } from './window.js';

/** @param {{robot: import('../lines.js').Thing}} props */
export function Sensors({ robot }) {
  const sensors = windowOf(robot.i)?.sensors ?? [];
  return html`<section class="panel" aria-label="Sensors"><h2>Sensors</h2>
    <dl class="sensors reported">${sensors.map((sensor) => html`<div key=${sensor.name}><dt>${plain(sensor.name)}</dt>
      <dd>${valueText(sensor)}${sensor.stuck && html` <span class="stuck">stuck</span>`}</dd></div>`)}</dl>
    ${!sensors.length && html`<p class="soft">It has none.</p>`}
  </section>`;
}
