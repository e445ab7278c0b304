/** Current values of a robot's sensors. */
import { html } from '../../vendor/preact.js';
import { plain } from '../ui/words.js';
import { windowOf } from './window.js';

const UNITS = /** @type {Record<string, string>} */ ({ degC: '°C', 1: '', 'kW/m2': 'kW/m²' });

/** @param {{robot: import('../lines.js').Thing}} props */
export function Sensors({ robot }) {
  const sensors = windowOf(robot.i)?.sensors ?? [];
  return html`<section class="panel" aria-label="Sensors"><h2>Sensors</h2>
    <dl class="sensors reported">${sensors.map((sensor) => html`<div key=${sensor.name}><dt>${plain(sensor.name)}</dt>
      <dd>${valueText(sensor)}${sensor.stuck && html` <span class="stuck">stuck</span>`}</dd></div>`)}</dl>
    ${!sensors.length && html`<p class="soft">It has none.</p>`}
  </section>`;
}

/** @param {import('../lines.js').Sensor} sensor */
function valueText({ name, unit, values, least }) {
  const label = UNITS[unit] ?? unit;
  if (least !== undefined) return `nearest ${least.toFixed(2)} ${label}`;
  if (!values?.length) return 'no value: it is lost';
  if (name === 'battery') return `${(100 * values[0]).toFixed(0)} %`;
  return `${values.join(' ')} ${label}`;
}
