/** Calibration screen: reference pose, tilt per step, and processing pipeline. */
import { html, useEffect, useState } from '../../vendor/preact.js';
import { maySteer, scene } from '../store.js';
import { choices, choose } from './choices.js';
import { isKnown, phone, sendCalibration, tilts } from './drive.js';
import { Choice, Field, Tick, wrongNumber } from '../ui/fields.js';
import { WORDS, ask, pose, shown, state } from './sensor.js';
import { capital } from '../ui/words.js';

const HANDS = /** @type {[string, string][]} */ ([['right', 'right'], ['left', 'left']]);
const WAYS = /** @type {[string, string][]} */ ([
  ['tilt', 'tilting the phone'],
  ['stick', 'stick, keys or gamepad'],
]);
const AXES = ['x', 'y', 'z'];
const FULL = 12; // of a bar [m/s^2]

/** The screen. */
export function CalibrationScreen() {
  useDefaults();
  const [marked, mark] = useState(false);
  const [result, setResult] = useState('');
  const { force, radius, delay, reference, calibrated } = choices.value;
  const wrong = {
    force: wrongNumber(force, 0.01, 10, 'm/s²'),
    radius: wrongNumber(radius, 0.01, 10, 'm/s²'),
    delay: wrongNumber(delay, 20, 5000, 'ms'),
  };
  const blind = tilts.value && state.value === 'looking';
  const calibrate = async () => {
    mark(true);
    setResult('');
    if (wrong.force || wrong.radius || wrong.delay) return;
    await ask();
    const held = tilts.peek() ? pose() : null;
    if (tilts.peek() && !held) return setResult('No sensor data is arriving, so nothing was calibrated.');
    const comma = (/** @type {string} */ text) => text.replace(',', '.').trim();
    const numbers = { force: comma(force), radius: comma(radius), delay: comma(delay) };
    choose({ ...numbers, reference: held, calibrated: true });
    const done = await sendCalibration(true);
    if (!isKnown.peek()) setResult('Saved on this phone. It takes effect once you have registered.');
    else if (done?.ok) setResult(choices.peek().keep ? `${capital(done.text)}.` : 'Calibrated.');
  };
  return html`<${Sensor} />
    <${Live} />
    <section aria-label="Steps" class="panel">
      <div class="pair">
      <${Field} name="Force" value=${force} wrong=${marked && wrong.force} mode="decimal"
        hint="m/s² for each level of speed" onInput=${(/** @type {string} */ t) => choose({ force: t })} />
      <${Field} name="Radius step" value=${radius} wrong=${marked && wrong.radius} mode="decimal"
        hint="m/s² for each degree/s" onInput=${(/** @type {string} */ t) => choose({ radius: t })} />
      </div>
      <${Field} name="Maximum delay" value=${delay} wrong=${marked && wrong.delay} mode="numeric"
        hint="ms between two messages" onInput=${(/** @type {string} */ t) => choose({ delay: t })} />
      <${Pipeline} />
    </section>
    <${Habits} />
    ${calibrated && html`<p class="soft">Kept: ${reference ? `reference ${reference.map((v) => v.toFixed(1)).join(', ')} m/s²` : 'no reference, steered by the stick'}.</p>`}
    <div class="thumb"><p role="status" aria-label="Calibration">${result}</p>
      <button type="button" class=${result ? 'big' : 'big go'} disabled=${!maySteer.value || blind}
        onClick=${calibrate}>Calibrate</button>
      ${calibrated && html`<a class=${result ? 'big go' : 'big'} href="#/teleoperation">Continue: Teleoperation</a>`}
    </div>`;
}

function useDefaults() {
  const offer = scene.value?.phone;
  useEffect(() => {
    const kept = choices.peek();
    choose({
      force: kept.force || String(offer?.speed_step_mps2 ?? 0.35),
      radius: kept.radius || String(offer?.turn_step_mps2 ?? 0.12),
      pipeline: kept.pipeline || (offer?.pipeline ?? ''),
      delay: kept.delay || String(Math.round(1000 * (offer?.max_delay_s ?? 0.5))),
    });
  }, [offer]);
}

/** State of the sensor, or the reason why it does not work. */
function Sensor() {
  const now = state.value;
  const bad = !['live', 'looking', 'tap'].includes(now);
  return html`<div role=${bad ? 'alert' : 'status'} aria-label="Sensor" class=${bad ? 'warning' : 'sensor'}>
    <span>${bad ? `no sensor: ${WORDS[now]}` : WORDS[now]}</span>
    ${['tap', 'denied'].includes(now) && html`<button type="button" key="sensor" onClick=${ask}>Turn on the sensor</button>`}
  </div>`;
}

/** Current sensor values, and the command that they would give. */
function Live() {
  const values = shown.value?.xyz ?? [];
  const [level, turn] = phone.value?.reading ?? [NaN, NaN];
  const rate = phone.value?.sensor_hz;
  return html`<section class="panel live" aria-label="Live values">
    ${AXES.map((axis, n) => html`<${Bar} name=${axis} value=${values[n] ?? NaN} full=${FULL} unit="m/s²" />`)}
    <${Bar} name="speed" value=${level} full=${10} unit="levels" />
    <${Bar} name="turn" value=${turn} full=${30} unit="°/s" />
    <p class="soft">${rate ? `${rate.toFixed(0)} samples a second reach the console.` : 'Speed and turn are shown once you have registered and calibrated.'}</p>
  </section>`;
}

/** @param {{name: string, value: number, full: number, unit: string}} props */
function Bar({ name, value, full, unit }) {
  const share = Math.max(-1, Math.min(1, (Number.isFinite(value) ? value : 0) / full));
  const at = { left: `${50 + 50 * Math.min(0, share)}%`, width: `${50 * Math.abs(share)}%` };
  return html`<div class="meter-row"><span>${name}</span>
    <span class="track" aria-hidden="true"><i style=${at}></i></span>
    <span class="value">${Number.isFinite(value) ? value.toFixed(1) : '–'} <small>${unit}</small></span></div>`;
}

function Pipeline() {
  const offer = scene.value?.phone;
  const { pipeline, filter, mapping } = choices.value;
  const pairs = (/** @type {string[]} */ names) =>
    /** @type {[string, string][]} */ (names.map((name) => [name, name]));
  const pipelines = Object.keys(offer?.pipelines ?? { default: 0, dissertation: 0 });
  return html`<${Choice} name="Pipeline" value=${pipeline} options=${pairs(pipelines)}
      onInput=${(/** @type {string} */ value) => choose({ pipeline: value })} />
    <${Choice} name="Filter" value=${filter} options=${[['', 'the pipeline’s own'], ...pairs(offer?.filters ?? [])]}
      onInput=${(/** @type {string} */ value) => choose({ filter: value })} />
    <${Choice} name="Mapping" value=${mapping} options=${pairs(offer?.mappings ?? ['absolute'])}
      onInput=${(/** @type {string} */ value) => choose({ mapping: value })} />`;
}

/** Settings for this phone alone. */
function Habits() {
  const { by, hand, hold, keep } = choices.value;
  return html`<section class="panel" aria-label="This phone"><h2>This phone</h2>
    <${Choice} name="Steer by" value=${by} options=${WAYS}
      onInput=${(/** @type {string} */ value) => choose({ by: value })} />
    <${Choice} name="Hand" value=${hand} options=${HANDS}
      onInput=${(/** @type {string} */ value) => choose({ hand: value })} />
    <${Tick} name="Hold to drive: lifting the thumb stops the robot" value=${hold}
      onInput=${(/** @type {boolean} */ value) => choose({ hold: value })} />
    <${Tick} name="Let the console keep my motion in a file, from the next Calibrate on" value=${keep}
      onInput=${(/** @type {boolean} */ value) => choose({ keep: value })} />
  </section>`;
}
