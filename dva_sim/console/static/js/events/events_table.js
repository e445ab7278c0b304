/** All events as a table; the current one has buttons for its first two steps. */
import { html } from '../../vendor/preact.js';
import { events, mayDispatch, maySteer, selection } from '../store.js';
import { act } from '../net/actions.js';
import { ageOf } from '../net/world_time.js';
import { eventsInOrder, isOpen } from '../map/shown.js';
import { SeverityMark, StateMark } from '../ui/icon.js';
import { ageText, capital, plain } from '../ui/words.js';
import { assignTo, chosen } from './proposal.js';
import { inHand } from './shared.js';

/** @typedef {import('../lines.js').SiteEvent} SiteEvent */

const HEADS = ['No.', 'What', 'Where', 'State', 'For', 'Who', 'Seen by', 'To do'];
const ASIDE = ['Where', 'For', 'Seen by']; // left out where there is little room: the panel has them

/** The table. */
export function EventsTable() {
  const list = eventsInOrder();
  const open = list.filter(isOpen).length;
  return html`<section aria-labelledby="events-heading" class="events-table">
    <h2 id="events-heading">Events <span class="count">${open} open of ${events.value.length}</span></h2>
    <div class="scroll" tabindex="0" role="group" aria-label="Table of events">
    <table aria-label="Events"><thead><tr>
      ${HEADS.map((head) => html`<th scope="col" class=${ASIDE.includes(head) ? 'aside' : ''}>${head}</th>`)}</tr></thead>
      <tbody class="reported">${list.map((event) => html`<${Row} key=${event.number} event=${event} />`)}
      ${!list.length && html`<tr><td colspan=${HEADS.length} class="none">Nothing has been reported.</td></tr>`}</tbody>
    </table></div></section>`;
}

/** @param {{event: SiteEvent}} props */
function Row({ event }) {
  const mine = inHand.value?.number === event.number;
  const open = isOpen(event);
  const choose = () => (selection.value = { kind: 'event', key: event.number });
  return html`<tr class=${`${mine ? 'mine' : ''} ${open ? '' : 'over'}`} aria-selected=${mine} onClick=${choose}>
    <th scope="row"><button type="button" class="plain" aria-label=${`Event ${event.number}`}
      aria-pressed=${mine} onClick=${choose}>${event.number}</button></th>
    <td><span class="pair"><${SeverityMark} severity=${event.severity} quiet=${!open} />${capital(plain(event.kind))}</span>
      <small>${event.severity}</small></td>
    <td class="aside">${event.room || 'outdoors'}</td>
    <td><span class="pair"><${StateMark} state=${event.state} />${plain(event.state)}</span></td>
    <td class="aside">${open ? ageText(ageOf(event.since_ms)) : ''}</td>
    <td>${event.assigned.join(', ')}</td>
    <td class="aside">${event.acknowledged?.label ?? ''}</td>
    <td class="do">${mine && open && mayDispatch.value && html`<${Steps} event=${event} />`}</td>
  </tr>`;
}

/** @param {{event: SiteEvent}} props */
function Steps({ event }) {
  const whom = chosen.value;
  const seen = Boolean(event.acknowledged);
  return html`<button type="button" disabled=${seen || !maySteer.value}
      onClick=${() => act('event_acknowledge', { event: event.number })}>Acknowledge</button>
    <button type="button" disabled=${!whom || !maySteer.value} title=${whom ? `Sends ${whom}` : 'Nobody is available'}
      onClick=${() => assignTo(event, whom)}>Assign</button>`;
}
