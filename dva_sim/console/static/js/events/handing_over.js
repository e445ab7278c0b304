/** Change of shift: who is there, what happened, handing over to a colleague, and offers of colleagues. */
import { html, useState } from '../../vendor/preact.js';
import { control, events, maySteer, you } from '../store.js';
import { act } from '../net/actions.js';
import { eventsInOrder, isOpen } from '../map/shown.js';
import { Choice, Field } from '../ui/fields.js';
import { plain } from '../ui/words.js';
import { History, useDetails } from './details.js';
import { colleagues, ownerOf, ownRoom } from './shared.js';

/** @param {{close: () => void}} props */
export function Shift({ close }) {
  const details = useDetails(null, events.value.length);
  const open = eventsInOrder().filter(isOpen);
  const rooms = control.value?.rooms ?? [];
  return html`<section class="panel shift" aria-label="Shift">
    <h2>Shift</h2>
    <h3>Open</h3>
    ${open.length ? html`<ul>${open.map((event) => html`<li key=${event.number}>Event ${event.number}, ${plain(event.kind)}, ${event.room || 'outdoors'}, ${event.severity}:
      ${' '}${ownerOf(event) || 'nobody answers for it'}</li>`)}</ul>` : html`<p class="none">No event is open.</p>`}
    <h3>Who is there</h3>
    ${rooms.length ? html`<ul>${rooms.map((room) => html`<li key=${room.client}>${room.label}, ${room.role}${
      room.client === you.value?.client ? ' (you)' : ''}</li>`)}</ul>` : html`<p class="none">Nobody decides here.</p>`}
    <${HandOver} />
    <h3>What happened</h3>
    <${History} details=${details} numbered />
    <button type="button" onClick=${close}>Back to the event</button>
  </section>`;
}

/** Offer of one event, or of all that one has in hand. @param {{event?: number}} props */
export function HandOver({ event }) {
  const [to, setTo] = useState('');
  const [note, setNote] = useState('');
  const names = colleagues.value;
  if (!ownRoom.value) return null;
  const whom = names.includes(to) ? to : names[0] ?? '';
  const offer = async () => {
    const done = await act('hand_over', { to: whom, note: note.trim(), ...(event === undefined ? {} : { event }) });
    if (done.ok) setNote('');
  };
  const made = (control.value?.offers ?? []).filter((one) => one.sender === ownRoom.value
    && (event === undefined ? one.whole : one.events.includes(event)));
  return html`${event === undefined && html`<h3>Hand over</h3>`}
    ${names.length ? html`<div class="hand-over">
      <${Choice} name="To" value=${whom} options=${names.map((name) => /** @type {[string, string]} */ ([name, name]))} onInput=${setTo} />
      <${Field} name="Note for them" value=${note} most=${256} onInput=${setNote} />
      <button type="button" disabled=${!maySteer.value} onClick=${offer}>${event === undefined
        ? 'Hand over all I have' : `Hand over event ${event}`}</button></div>`
      : html`<p class="none">No colleague is there.</p>`}
    <div role="status" aria-label="Handed over">${made.map((one) => html`<p key=${one.number}>${one.to}
      ${' '}${one.accepted === null ? 'has not answered yet' : one.accepted ? 'has taken over' : 'has declined'}: ${workOf(one)}.</p>`)}</div>`;
}

/** @param {import('../lines.js').Offer} offer */
const workOf = (offer) => [...offer.events.map((number) => `event ${number}`), ...offer.robots].join(', ') || 'no event and no robot';

/** Offers to this page's person. */
export function Offers() {
  const offers = (control.value?.offers ?? []).filter((one) => one.client === you.value?.client && one.accepted === null);
  return offers.map((one) => html`<section key=${one.number} class="panel offer" aria-label=${`Offer of ${one.sender}`} role="alert">
    <p><b>${one.sender}</b> hands over to you: ${workOf(one)}${one.whole ? ', all that they have' : ''}.${one.note && html` “${one.note}”`}</p>
    <div class="buttons">
      <button type="button" class="primary" disabled=${!maySteer.value}
        onClick=${() => act('hand_over_answer', { offer: one.number, accept: true })}>Take over</button>
      <button type="button" disabled=${!maySteer.value}
        onClick=${() => act('hand_over_answer', { offer: one.number, accept: false })}>Decline</button></div>
  </section>`);
}
