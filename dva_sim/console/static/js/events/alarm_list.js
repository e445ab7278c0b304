/** Alarm list, most severe first; only new alarms are highlighted, for 5 seconds. */
import { html, useState } from '../../vendor/preact.js';
import { alarmList, mayDispatch, selection } from '../store.js';
import { act } from '../net/actions.js';
import { ageOf, sinceSent } from '../net/world_time.js';
import { SeverityMark } from '../ui/icon.js';
import { ageText } from '../ui/words.js';

const SHELF_S = 900;

/** @typedef {import('../lines.js').AlarmRow} AlarmRow */

/** Active and shelved alarms. */
export function AlarmList() {
  const { alarms, shelved, flood, rate } = alarmList.value;
  const unseen = alarms.filter((alarm) => alarm.state !== 'acknowledged').length;
  return html`<section class="alarms-panel" aria-label="Alarms">
    <h2>Alarms <span class="count">${unseen ? `${unseen} not seen` : 'all seen'}</span></h2>
    ${flood && html`<p class="flood" role="status">${rate} alarms in 10 minutes: similar ones are grouped.</p>`}
    ${!alarms.length && html`<p class="none">No alarms.</p>`}
    <ul class="rows">${alarms.map((alarm) => html`<${Row} key=${alarm.key} alarm=${alarm} />`)}</ul>
    ${shelved.length > 0 &&
    html`<details><summary>Shelved (${shelved.length})</summary>
      <ul class="rows">${shelved.map((alarm) => html`<${Shelved} key=${alarm.key} alarm=${alarm} />`)}</ul></details>`}
  </section>`;
}

/** @param {{alarm: AlarmRow}} props */
function Row({ alarm }) {
  const [busy, setBusy] = useState(false);
  const ask = async (/** @type {import('../net/actions.js').Action} */ what, /** @type {object} */ more = {}) => {
    setBusy(true);
    await act(what, { alarm: alarm.key, ...more });
    setBusy(false);
  };
  const open = () => {
    if (alarm.event !== null) selection.value = { kind: 'event', key: alarm.event };
  };
  const seen = alarm.state === 'acknowledged';
  return html`<li class=${`alarm reported ${alarm.state} ${alarm.is_new ? 'new' : ''}`}>
    <${SeverityMark} severity=${alarm.priority} quiet=${seen} />
    <button type="button" class="plain text" onClick=${open} disabled=${alarm.event === null}>${alarm.text}</button>
    <span class="soft">${alarm.state}${alarm.seen_by ? ` by ${alarm.seen_by}` : ''}</span>
    <b>${ageText(ageOf(alarm.since_ms))}</b>
    ${mayDispatch.value &&
    html`<span class="do">${!seen &&
      html`<button type="button" disabled=${busy} aria-label=${`Seen: ${alarm.text}`}
        onClick=${() => ask('alarm_acknowledge')}>Seen</button>`}
      <button type="button" disabled=${busy} aria-label=${`Shelve for 15 minutes: ${alarm.text}`}
        title="Hide it for 15 minutes"
        onClick=${() => ask('alarm_shelve', { for_s: SHELF_S })}>Shelve</button></span>`}
  </li>`;
}

/** @param {{alarm: AlarmRow}} props */
function Shelved({ alarm }) {
  const left = Math.max(0, (alarm.left_s ?? 0) - sinceSent(alarmList.value));
  const back = () => act('alarm_unshelve', { alarm: alarm.key });
  return html`<li class="alarm shelved reported"><${SeverityMark} severity=${alarm.priority} quiet />
    <span class="text">${alarm.text}</span>
    <span class="soft">by ${alarm.shelved_by}, for another ${ageText(1000 * left)}</span>
    ${mayDispatch.value &&
    html`<button type="button" aria-label=${`Unshelve: ${alarm.text}`} onClick=${back}>Unshelve</button>`}
  </li>`;
}
