/** Sensors of a robot in hand, read while one drives: chosen by name, with ages and alarm values. */
import { html, useState } from '../../vendor/preact.js';
import { driveOf, maySteer, seat } from '../store.js';
import { act } from '../net/actions.js';
import { Choice, Tick } from '../ui/fields.js';
import { useRequested } from '../ui/requested.js';
import { unitText, valueText } from '../ui/sensor_text.js';
import { capital, plain } from '../ui/words.js';

/** @typedef {import('../lines.js').Sensed} Sensed */

const RATES = /** @type {[string, string][]} */ (['0.2', '0.5', '1', '2', '5', '10'].map((rate) => [rate, `${rate} Hz`]));
const DIGITS = 3;

/** @param {{robot: import('../lines.js').Thing}} props */
export function Sensing({ robot }) {
  void seat.value;
  const sensors = driveOf(robot.i)?.sensors ?? [];
  const read = sensors.filter((one) => one.rate_hz !== null);
  const [rate, setRate] = useState(String(read[0]?.rate_hz ?? 1));
  const sense = (/** @type {string[]} */ names, hz = rate) =>
    act('sense', { robot: robot.i, sensors: names, rate_hz: Number(hz) });
  const [names, choose] = useRequested(read.map((one) => one.name), sense, (chosen) => [...chosen].sort().join());
  if (!sensors.length || !maySteer.value) return null;
  const tick = (/** @type {string} */ name, /** @type {boolean} */ on) =>
    choose(on ? [...names, name] : names.filter((one) => one !== name));
  const pace = (/** @type {string} */ hz) => {
    setRate(hz);
    if (names.length) sense(names, hz);
  };
  return html`<section class="sensing" aria-label=${`Sensors of ${robot.label}`}>
    <ul class="reported">${read.map((one) => html`<li key=${one.name} class=${isAlarming(one) ? 'alarming' : ''}>
      <b>${capital(plain(one.name))}</b> ${text(one)} <small>${about(one)}</small></li>`)}</ul>
    <details><summary>Choose sensors</summary>
      ${sensors.map((one) => html`<${Tick} key=${one.name} name=${capital(plain(one.name))} value=${names.includes(one.name)}
        onInput=${(/** @type {boolean} */ on) => tick(one.name, on)} />`)}
      <${Choice} name="Frequency" value=${rate} options=${RATES} onInput=${pace} /></details>
  </section>`;
}

/** @param {Sensed} sensor */
function text({ name, unit, values, least }) {
  if (!values && least === undefined) return 'waiting for a value';
  return valueText({ name, unit, least, values: values?.map((value) => Number(value.toPrecision(DIGITS))) });
}

/** Age of the value, and from where on it is an alarm. @param {Sensed} sensor */
function about({ age_s: age, alarm_at: alarm, unit }) {
  const parts = [age !== null && `${age.toFixed(1)} s old`, alarm !== null && `alarm from ${Number(alarm.toPrecision(DIGITS))} ${unitText(unit)}`];
  return parts.filter(Boolean).join(', ');
}

/** @param {Sensed} sensor */
const isAlarming = ({ values, alarm_at: alarm }) => alarm !== null && (values?.[0] ?? -Infinity) >= alarm;
