/** Notices of every page: emergency stops, refusals, and data that is out of date. */
import { html } from '../../vendor/preact.js';
import { notice, rows, thingAt } from '../store.js';
import { giveUp, refused, stopped, unconfirmed } from '../net/emergency.js';
import { isStale, newestTime } from '../net/world_time.js';
import { EmergencyBar } from './emergency_bar.js';
import { Icon } from './icon.js';
import { clockText } from './words.js';

/** @param {{others?: any[]}} props `others` are texts that the page shows itself */
export function Notices({ others = [] }) {
  return html`<${EmergencyBar} /><${EmergencyReport} /><${Silence} /><${DvaSilence} />
    ${notice.value && !others.includes(notice.value) && html`<${Note} text=${notice.value} onDismiss=${() => (notice.value = '')} />`}`;
}

/** Emergency stops of this page: pending, refused, confirmed. */
function EmergencyReport() {
  return html`${unconfirmed.value &&
    html`<p class="warning unconfirmed-stop">${unconfirmed.value} A driven robot stops by its watchdog; a robot
        on a mission may go on. <button type="button" class="plain" onClick=${giveUp}>Stop asking</button></p>`}
    ${refused.value &&
    html`<${Note} look="unconfirmed-stop" text=${`Emergency stop refused: ${refused.value}`}
      onDismiss=${() => (refused.value = '')} />`}
    ${stopped.value.size > 0 &&
    html`<${Note} look="stopped" text=${stoppedText()} onDismiss=${() => (stopped.value = new Map())} />`}`;
}

/** Robots that have confirmed that they stand, by the time of their confirmation. */
function stoppedText() {
  const byTime = /** @type {Record<string, string[]>} */ ({});
  for (const [i, at] of stopped.value) (byTime[clockText(at)] ??= []).push(thingAt(i)?.label ?? String(i));
  const parts = Object.entries(byTime).map(([time, labels]) => `${labels.join(', ')} at ${time}`);
  return `Your emergency stop is confirmed: ${parts.join('; ')}.`;
}

/** Note that nothing has arrived for some time, and since when. */
function Silence() {
  if (!isStale.value) return null;
  return html`<p class="warning silence">No data since ${clockText(newestTime())}. Greyed values are from then.</p>`;
}

/** Warning that the DVA does not answer, or that its server is stopped. */
function DvaSilence() {
  const server = /** @type {any} */ (rows.value?.server);
  if ((server?.hearing ?? 'answers') === 'answers') return null;
  const text = server.own !== false && !server.listens
    ? "The DVA's server is stopped: start it on the console's page Main. What you see is out of date."
    : server.hearing === 'never'
      ? `No DVA has answered at ${server.address} since the console was started. Retrying …`
      : `The DVA at ${server.address} is silent. What you see is out of date. Retrying …`;
  return html`<p class="warning">${text}</p>`;
}

/** @param {{text: string, onDismiss: () => void, look?: string}} props */
function Note({ text, onDismiss, look = '' }) {
  return html`<p class=${`warning note ${look}`}><span>${text}</span>
    <button type="button" class="plain" aria-label="Dismiss" onClick=${onDismiss}><${Icon} name="x" /></button></p>`;
}
