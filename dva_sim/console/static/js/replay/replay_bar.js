/** Replay bar: play, pause, speed, position, and jumps between events. */
import { html } from '../../vendor/preact.js';
import { clock, replay } from '../store.js';
import { act } from '../net/actions.js';
import { shownTime } from '../net/world_time.js';
import { Icon } from '../ui/icon.js';
import { Slider } from '../ui/slider.js';
import { clockText } from '../ui/words.js';

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 8, 20];
const SLACK_MS = 700; // so soon after a mark the one before it is meant

/** The bar, while a recording is shown. */
export function ReplayBar() {
  const about = replay.value;
  if (!about) return null;
  const now = Math.min(shownTime(), about.duration_ms);
  return html`<section class="replay-bar" aria-label="Replay">
    <${Buttons} now=${now} marks=${about.marks} />
    <${Scrubber} about=${about} now=${now} />
    <${Speed} />
    ${about.whole ? null : html`<p class="soft">This recording was cut short.</p>`}
  </section>`;
}

/** @param {number} ms */
const seek = (ms) => act('seek', { t_ms: Math.max(0, Math.round(ms)) });

/** @param {{now: number, marks: import('../lines.js').Happened[]}} props */
function Buttons({ now, marks }) {
  const { paused } = clock.value;
  const before = marks.filter((mark) => mark.t < now - SLACK_MS).at(-1);
  const after = marks.find((mark) => mark.t > now + 1);
  return html`<div class="replay-buttons">
    <button type="button" disabled=${!before} onClick=${() => before && seek(before.t)}
      title=${before ? `${before.who} ${before.what}` : ''}>Previous event</button>
    <button type="button" class="primary" onClick=${() => act('pace', { paused: !paused })}>
      <${Icon} name=${paused ? 'play' : 'pause'} />${paused ? 'Play' : 'Pause'}</button>
    <button type="button" disabled=${!after} onClick=${() => after && seek(after.t)}
      title=${after ? `${after.who} ${after.what}` : ''}>Next event</button>
  </div>`;
}

/** @param {{about: import('../lines.js').ReplayAbout, now: number}} props */
function Scrubber({ about, now }) {
  const whole = about.duration_ms || 1;
  return html`<div class="scrubber">
    <${Slider} name="Replay position" min=${0} max=${about.duration_ms} step=${100} value=${now}
      text=${clockText} onInput=${seek} />
    <div class="marks" aria-hidden="true">${about.marks.map(
      (mark) => html`<span class=${`tick ${mark.kind}`} style=${{ left: `${(100 * mark.t) / whole}%` }}
        title=${`${clockText(mark.t)} ${mark.who} ${mark.what}`}></span>`,
    )}</div>
  </div>`;
}

function Speed() {
  const { factor } = clock.value;
  const gaps = SPEEDS.map((speed) => Math.abs(speed - factor));
  return html`<${Slider} name="Replay speed" min=${0} max=${SPEEDS.length - 1} step=${1}
    value=${gaps.indexOf(Math.min(...gaps))}
    text=${(/** @type {number} */ n) => `×${SPEEDS[n]}`}
    onInput=${(/** @type {number} */ n) => act('pace', { factor: SPEEDS[n] })} />`;
}
