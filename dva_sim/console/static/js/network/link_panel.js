/** Link panel: settings of the link, and the speed of the simulation. */
import { html, useEffect, useRef, useState } from '../../vendor/preact.js';
import { FASTEST } from '../declared.js';
import { clock, isAttached, isModelled, link, maySteer, scene } from '../store.js';
import { act } from '../net/actions.js';
import { Slider } from '../ui/slider.js';
import { rateText } from '../ui/words.js';

const SETTLE_MS = 120;
const QUIET_MS = 1500;
const EACH = 100; // steps of the rate's slider

/**
 * @typedef {{name: string, key: string, unit: number, step: number, limits: number[],
 *   text: (value: number) => string, hint: string}} Knob
 */

const ms = (/** @type {number} */ value) => `${Math.round(value)} ms`;

/** @type {Knob[]} */
const KNOBS = [
  { name: 'Delay', key: 'delay_s', unit: 1000, step: 10, limits: [0, 5], text: ms, hint: 'Between console and robots, one way' },
  { name: 'Jitter', key: 'jitter_s', unit: 1000, step: 5, limits: [0, 1], text: ms,
    hint: 'How much the delay varies' },
  {
    name: 'Loss', key: 'loss', unit: 100, step: 0.5, limits: [0, 0.5], hint: 'Share of packets lost',
    text: (value) => `${Number(value.toFixed(1))} %`,
  },
  {
    name: 'Processing time', key: 'processing_s', unit: 1000, step: 10, limits: [0, 3], text: ms,
    hint: 'Time the robot’s computer needs for each command',
  },
]; // prettier-ignore

/** @param {{heading?: string}} props */
export function LinkPanel({ heading = 'Link' }) {
  if (!isModelled.value) return html`<${RealLink} />`;
  return html`<section class="panel link-panel" aria-label="Link settings">
    <h2>${heading}</h2>
    <${Presets} />
    <div class="knobs">
      ${KNOBS.map((knob) => html`<${LinkSlider} key=${knob.key} knob=${knob} />`)}
      <${Bandwidth} /><${TimeFactor} /><${JitterNote} />
    </div>
  </section>`;
}

/** Panel for real sockets: only the robots' processing time can be set, as it is still simulated. */
function RealLink() {
  const knob = KNOBS[KNOBS.length - 1];
  return html`<section class="panel link-panel" aria-label="Link settings">
    <h2>A real link</h2>
    <p class="soft">Messages use real sockets in real time. Delay, jitter and loss are those of the real network.</p>
    ${!isAttached.value && html`<div class="knobs"><${LinkSlider} knob=${knob} /></div>`}
  </section>`;
}

/**
 * Value of a slider: the reported one, unless the person has just moved it.
 * @param {number} reported
 * @param {(value: number) => void} send
 * @returns {[number, (value: number) => void]}
 */
function useOwn(reported, send) {
  const [own, keep] = useState(/** @type {number | null} */ (null));
  const timers = useRef({ send: 0, forget: 0 });
  useEffect(() => () => Object.values(timers.current).forEach((timer) => window.clearTimeout(timer)), []);
  const set = (/** @type {number} */ value) => {
    keep(value);
    window.clearTimeout(timers.current.send);
    window.clearTimeout(timers.current.forget);
    timers.current.send = window.setTimeout(() => send(value), SETTLE_MS);
    timers.current.forget = window.setTimeout(() => keep(null), QUIET_MS);
  };
  return [own ?? reported, set];
}

/** @param {{knob: Knob}} props */
function LinkSlider({ knob }) {
  const setting = /** @type {any} */ (link.value ?? {});
  const [least, most] = scene.value?.link_limits?.[knob.key] ?? knob.limits;
  const [value, set] = useOwn((setting[knob.key] ?? 0) * knob.unit, (wanted) =>
    act('link', { [knob.key]: wanted / knob.unit }),
  );
  return html`<${Slider} name=${knob.name} min=${least * knob.unit} max=${most * knob.unit}
    step=${knob.step} value=${value} text=${knob.text} hint=${knob.hint}
    disabled=${!maySteer.value} onInput=${set} />`;
}

/** Note that explains why the jitter is lower than requested. */
function JitterNote() {
  const { jitter_s: is = 0, jitter_wanted_s: wanted = 0 } = link.value ?? {};
  const text = wanted > is + 1e-6 ? `${ms(1000 * wanted)} of jitter are wanted; it is kept within the delay.` : '';
  return html`<p class="jitter-note soft" role="status">${text}</p>`;
}

/** Logarithmic slider from 10 kbit/s to 1 Gbit/s; disabled while a recorded trace sets the rate. */
function Bandwidth() {
  const [least, most] = scene.value?.link_limits?.rate_bps ?? [1e4, 1e9];
  const decades = Math.log10(most / least);
  const rateOf = (/** @type {number} */ step) => least * 10 ** ((decades * step) / EACH);
  const reported = link.value?.rate_bps ?? most;
  const at = Math.round((EACH * Math.log10(reported / least)) / decades);
  const [value, set] = useOwn(at, (step) => act('link', { rate_bps: Math.round(rateOf(step)) }));
  const trace = link.value?.rate_trace;
  const text = (/** @type {number} */ step) => (trace ? 'by the trace' : rateText(rateOf(step)));
  return html`<${Slider} name="Bandwidth" min=${0} max=${EACH} step=${1} value=${value}
    text=${text} hint="Link rate, in each direction"
    disabled=${!maySteer.value || Boolean(trace)} onInput=${set} />`;
}

function TimeFactor() {
  const [value, set] = useOwn(clock.value.factor, (factor) => act('pace', { factor }));
  return html`<${Slider} name="Time factor" min=${1} max=${FASTEST} step=${1} value=${value}
    text=${(/** @type {number} */ factor) => `× ${Number(factor.toFixed(1))}`}
    hint="Simulation speed, as a multiple of real time" disabled=${!maySteer.value} onInput=${set} />`;
}

const PRESETS = [0, 100, 250, 500, 1000];

function Presets() {
  const now = Math.round(1000 * (link.value?.delay_s ?? 0));
  return html`<div class="presets" role="group" aria-label="Usual delays">${PRESETS.map(
    (delay) => html`<button type="button" aria-pressed=${now === delay} disabled=${!maySteer.value}
      onClick=${() => act('link', { delay_s: delay / 1000 })}>${delay < 1000 ? `${delay} ms` : `${delay / 1000} s`}</button>`,
  )}</div>`;
}
