/** Details of events: their history, and instructions with steps to tick. */
import { html, signal, useEffect } from '../../vendor/preact.js';
import { connection, mayDispatch, maySteer } from '../store.js';
import { act, ask } from '../net/actions.js';
import { ageOf } from '../net/world_time.js';
import { useRequested } from '../ui/requested.js';
import { ageText, capital, plain } from '../ui/words.js';

/** @typedef {import('../lines.js').Details} Details */
/** @typedef {import('../lines.js').Step} Step */

const REFRESH_MS = 3000; // others tick steps, too

const known = signal(/** @type {Details | null} */ (null));

const WORDS = /** @type {Record<string, string>} */ ({
  acknowledge: 'acknowledged', assign: 'sent', expire: 'expired', escalate: 'escalated', raise: 'raised here',
  take_off: 'called off', false_alarm: 'false alarm', severity: 'severity', pending: 'waits again',
});

/** @param {number | null} event number; null: all events */
async function load(event) {
  const done = document.hidden ? null : await ask('event_details', event === null ? {} : { event });
  if (done?.ok && done.details) known.value = done.details;
}

/** Keep the details of an event fresh while they are shown. @param {number | null} event @param {unknown} change */
export function useDetails(event, change) {
  useEffect(() => {
    if (connection.peek() !== 'open') return undefined;
    load(event);
    const timer = window.setInterval(() => load(event), REFRESH_MS);
    return () => window.clearInterval(timer);
  }, [event, change, connection.value]);
  return known.value?.event === event ? known.value : null;
}

/** Instructions of an event, with boxes to tick. @param {{event: number, details: Details | null}} props */
export function Instructions({ event, details }) {
  const lines = details?.instructions ?? [];
  if (!lines.length) return null;
  const steps = lines.filter((line) => line.step !== null);
  const off = !mayDispatch.value || !maySteer.value;
  return html`<details class="instructions" open><summary>Instructions
    (${steps.filter((line) => line.done).length} of ${steps.length} done)</summary>
    ${lines.map((line, place) => line.step === null
      ? html`<p key=${place}>${line.text}</p>`
      : html`<${Instruction} key=${place} event=${event} line=${line} off=${off} />`)}
  </details>`;
}

/** @param {{event: number, line: Details['instructions'][number], off: boolean}} props */
function Instruction({ event, line, off }) {
  const [done, tick] = useRequested(Boolean(line.done), async (wanted) => {
    const answer = await act('event_tick', { event, step: line.step, done: wanted });
    load(event);
    return answer;
  });
  return html`<label class="tick"><input type="checkbox" checked=${done} disabled=${off}
    onInput=${(/** @type {any} */ typed) => tick(typed.currentTarget.checked)} />
    <span>${line.text}${line.done && html` <small>${line.done.label}, ${ageText(ageOf(line.done.at_ms))} ago</small>`}</span></label>`;
}

/** Steps in the order of their times; of all events together the newest first. @param {{details: Details | null, numbered?: boolean}} props */
export function History({ details, numbered = false }) {
  if (!details) return null;
  const steps = numbered ? [...details.history].reverse() : details.history;
  if (!steps.length) return html`<p class="none">Nothing has happened.</p>`;
  return html`<ol class="history">${steps.map((step) => html`<li key=${`${step.event} ${step.at_ms} ${step.what} ${step.device}`}>
    <span class="figure">${ageText(ageOf(step.at_ms))} ago</span>
    <span>${numbered && html`<b>Event ${step.event}</b> `}${stepText(step)}</span></li>`)}</ol>`;
}

/** @param {Step} step */
function stepText(step) {
  const what = WORDS[step.what] ?? plain(step.what);
  const about = [step.device, step.reason].filter(Boolean).join(', ');
  return `${capital(what)}${step.who ? ` by ${step.who}` : ''}${about ? `: ${about}` : ''}`;
}
