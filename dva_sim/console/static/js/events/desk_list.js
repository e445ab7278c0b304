/** The list of the desk: open events and alarms of the system, the worst first, then what is closed. */
import { html, useState } from '../../vendor/preact.js';
import { alarmList, events, mayDispatch } from '../store.js';
import { act } from '../net/actions.js';
import { ageOf, sinceSent } from '../net/world_time.js';
import { isOpen } from '../map/shown.js';
import { SeverityMark, StateMark } from '../ui/icon.js';
import { ageText, capital, plain } from '../ui/words.js';
import { RANKS } from '../shell/unseen.js';
import { closedEvents, FILTERS, filter, inHand, isUnseen, openEvents, ownerOf, select, shelfOf } from './shared.js';
import { Shelve } from './shelve.js';

/** @typedef {import('../lines.js').SiteEvent} SiteEvent */
/** @typedef {import('../lines.js').AlarmRow} AlarmRow */

/** The list. */
export function DeskList() {
  const { alarms, shelved, flood, rate } = alarmList.value;
  const open = openEvents.value;
  const newOnes = new Set(alarms.flatMap((alarm) => (alarm.is_new && alarm.event !== null ? [alarm.event] : [])));
  const all = events.value.filter(isOpen);
  const others = alarms.filter((alarm) => !all.some((event) => event.number === alarm.event));
  const rows = [...others, ...open].sort((one, other) => rankOf(other) - rankOf(one));
  return html`<section aria-labelledby="events-heading">
    <h2 id="events-heading">Events <span class="count">${all.length} open, ${all.filter(isUnseen).length} not acknowledged</span></h2>
    <${Filters} />
    ${flood && html`<p class="flood" role="status">${rate} alarms in 10 minutes: similar ones are grouped.</p>`}
    <ul class="rows desk-rows reported" aria-label="Open events and alarms">
      ${rows.map((row) => ('key' in row ? html`<${SystemAlarm} key=${row.key} alarm=${row} />`
        : html`<${Row} key=${row.number} event=${row} isNew=${newOnes.has(row.number)} />`))}</ul>
    ${!rows.length && html`<p class="none">${all.length ? 'No open event is listed here.' : events.value.length ? 'No event is open.' : 'Nothing has been reported.'}</p>`}
    ${shelved.length > 0 && html`<details open><summary>Shelved (${shelved.length})</summary>
      <ul class="rows">${shelved.map((alarm) => html`<${Shelved} key=${alarm.key} alarm=${alarm} />`)}</ul></details>`}
    ${closedEvents.value.map(([ending, list]) => html`<details key=${ending}>
      <summary>${capital(plain(ending))} (${list.length})</summary>
      <ul class="rows desk-rows reported" aria-label=${capital(plain(ending))}>
        ${list.map((event) => html`<${Row} key=${event.number} event=${event} />`)}</ul></details>`)}
  </section>`;
}

/** Rank in the list: by severity; last is what is over. @param {SiteEvent | AlarmRow} row */
const rankOf = (row) => ('key' in row ? row.state === 'returned' ? -1 : RANKS.indexOf(row.priority) : RANKS.indexOf(row.severity));

const STATES = /** @type {Record<string, string>} */ ({ unacknowledged: 'not acknowledged', returned: 'over, not acknowledged' });

function Filters() {
  return html`<div class="chips" role="group" aria-label="Shown events">${FILTERS.map((name) => html`<button
    type="button" class="plain" aria-pressed=${filter.value === name} onClick=${() => (filter.value = name)}>
    ${capital(name)}</button>`)}</div>`;
}

/** @param {{event: SiteEvent, isNew?: boolean}} props */
function Row({ event, isNew = false }) {
  const mine = inHand.value?.number === event.number;
  const what = `${capital(plain(event.kind))}, ${event.room || 'outdoors'}`;
  const age = event.over ? '' : ageText(ageOf(event.since_ms));
  const look = [event.over ? 'over' : isUnseen(event) ? 'unacknowledged' : 'acknowledged', isNew && 'new'];
  return html`<li class=${`desk-row ${look.filter(Boolean).join(' ')}`} data-event=${event.number}>
    <button type="button" class="row" aria-pressed=${mine} onClick=${() => select(event.number)}>
      <${SeverityMark} severity=${event.severity} quiet=${event.over} />
      <span class="what"><span class="hidden">Event </span>${event.number} ${what}<small>${[event.severity, event.assigned.join(', ')].filter(Boolean).join(' · ')}
        ${ownerOf(event) && html` · <span class="by">${ownerOf(event)}</span>`}${!event.over && shelfOf(event) && ' · shelved'}</small></span>
      <span class="state"><${StateMark} state=${event.state} />${plain(event.state)}<small>${age}</small></span>
    </button></li>`;
}

/** Alarm that is about no single open event. @param {{alarm: AlarmRow}} props */
function SystemAlarm({ alarm }) {
  const [busy, setBusy] = useState(false);
  const acknowledge = async () => {
    setBusy(true);
    await act('alarm_acknowledge', { alarm: alarm.key });
    setBusy(false);
  };
  const seen = alarm.state === 'acknowledged';
  return html`<li class=${`desk-row alarm ${alarm.state} ${alarm.is_new ? 'new' : ''}`}>
    <${SeverityMark} severity=${alarm.priority} quiet=${seen} />
    <button type="button" class="plain text" disabled=${alarm.event === null}
      onClick=${() => select(alarm.event ?? 0)}>${alarm.text}</button>
    <b>${ageText(ageOf(alarm.since_ms))}</b>
    <span class="soft">${STATES[alarm.state] ?? alarm.state}${alarm.seen_by ? ` by ${alarm.seen_by}` : ''}</span>
    ${mayDispatch.value && html`<span class="do">${!seen && html`<button type="button" key="seen" disabled=${busy}
        aria-label=${`Acknowledge: ${alarm.text}`} onClick=${acknowledge}>Acknowledge</button>`}
      <${Shelve} alarm=${alarm} /></span>`}
  </li>`;
}

/** @param {{alarm: AlarmRow}} props */
function Shelved({ alarm }) {
  const left = Math.max(0, (alarm.left_s ?? 0) - sinceSent(alarmList.value));
  return html`<li class="desk-row alarm shelved reported"><${SeverityMark} severity=${alarm.priority} quiet />
    <button type="button" class="plain text" disabled=${alarm.event === null}
      onClick=${() => select(alarm.event ?? 0)}>${alarm.text}</button>
    <span class="soft">by ${alarm.shelved_by}, for another ${ageText(1000 * left)}${alarm.shelved_why && `: ${alarm.shelved_why}`}</span>
    ${mayDispatch.value && html`<span class="do"><button type="button" aria-label=${`Unshelve: ${alarm.text}`}
      onClick=${() => act('alarm_unshelve', { alarm: alarm.key })}>Unshelve</button></span>`}
  </li>`;
}
