/** Switches that inject faults into a robot; switching a fault off undoes it. */
import { html, useState } from '../../vendor/preact.js';
import { MAX_PROCESSING_S } from '../declared.js';
import { maySteer } from '../store.js';
import { act } from '../net/actions.js';
import { useRequested } from '../ui/requested.js';
import { Slider } from '../ui/slider.js';
import { plain } from '../ui/words.js';
import { windowOf } from './window.js';

const KNOBS = /** @type {[string, string, string][]} */ ([
  ['replies', 'Drop replies', 'The robot obeys, but its replies are dropped, so callers time out.'],
  ['freeze', 'Freeze', 'Its computer hangs: it receives and sends nothing. The watchdog stops it; then it restarts idle.'],
  ['camera', 'Lose the camera', 'The camera takes no pictures.'],
]);

/** @typedef {import('../lines.js').Thing} Thing */

/** @param {{robot: Thing}} props */
export function Faults({ robot }) {
  const faults = windowOf(robot.i)?.faults;
  const stuck = (windowOf(robot.i)?.sensors ?? []).filter((sensor) => sensor.stuck);
  const some = faults && (faults.processing_s !== null || KNOBS.some(([key]) => /** @type {any} */ (faults)[key]) || stuck.length);
  return html`<section class=${some ? 'panel faults some' : 'panel faults'} aria-label="Faults">
    <h2>Faults <span class="count">${some ? 'active' : 'none'}</span></h2>
    <${Processing} robot=${robot} />
    ${KNOBS.map(([key, name, hint]) => html`<${Knob} key=${key} name=${name} hint=${hint}
      on=${Boolean(/** @type {any} */ (faults)?.[key])} ask=${{ robot: robot.i, what: key }} />`)}
    ${(robot.sensors ?? []).map((sensor) => html`<${Knob} key=${sensor} name=${`Stuck: ${plain(sensor)}`}
      hint="The sensor keeps repeating its last value." on=${stuck.some((one) => one.name === sensor)}
      ask=${{ robot: robot.i, what: 'sensor', sensor }} />`)}
  </section>`;
}

/** @param {{name: string, hint: string, on: boolean, ask: object}} props */
function Knob({ name, hint, on, ask }) {
  const [shown, change] = useRequested(on, (wanted) => act('fault', { ...ask, on: wanted }));
  return html`<label class="tick" title=${hint}><input type="checkbox" checked=${shown} disabled=${!maySteer.value}
    onInput=${(/** @type {any} */ event) => change(event.currentTarget.checked)} /> ${name}</label>`;
}

/** @param {{robot: Thing}} props */
function Processing({ robot }) {
  const reported = windowOf(robot.i)?.faults.processing_s ?? null;
  const [own, set] = useState(MAX_PROCESSING_S);
  const ask = (/** @type {boolean} */ on, seconds = own) =>
    act('fault', { robot: robot.i, what: 'processing', on, ...(on ? { seconds } : {}) });
  const [isSlow, slow] = useRequested(reported !== null, (on) => ask(on));
  const change = (/** @type {number} */ seconds) => {
    set(seconds);
    if (reported !== null) ask(true, seconds);
  };
  return html`<div class="processing">
    <label class="tick" title="Its computer needs this long for each message."><input type="checkbox" checked=${isSlow}
      disabled=${!maySteer.value} onInput=${(/** @type {any} */ event) => slow(event.currentTarget.checked)} /> Slow computer</label>
    <${Slider} name="Processing time" min=${0} max=${MAX_PROCESSING_S} step=${0.1} value=${reported ?? own}
      disabled=${!maySteer.value} text=${(/** @type {number} */ s) => `${s.toFixed(1)} s`} onInput=${change} />
  </div>`;
}
