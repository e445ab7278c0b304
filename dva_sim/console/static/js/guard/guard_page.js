/** Guard page: the current order with its route, reports on it, and the guard's position. */
import { html, render, useEffect, useState } from '../../vendor/preact.js';
import { connection, guard, mayDrive, maySteer, scene, tracks } from '../store.js';
import { act } from '../net/actions.js';
import { resumeStops } from '../net/emergency.js';
import { MapBox } from '../map/map_box.js';
import { placeOf } from '../map/shown.js';
import { EmergencyFooter } from '../phone/emergency_footer.js';
import { useEvery } from '../ui/every.js';
import { Notices } from '../ui/notices.js';
import { capital, plain } from '../ui/words.js';
import { NO_PLAYED_GUARD, playedGuards } from './played.js';
import { canLocate, locating, follow } from './position.js';
import { Report } from './report.js';

/** @param {HTMLElement} where */
export function showGuard(where) {
  where.replaceChildren();
  render(html`<${App} />`, where);
  resumeStops();
}

function App() {
  const me = guard.value;
  return html`<div class="phone guard">
    <header class="top"><a class="back" href="/phone">‹ Phone</a>
      <h1>${me ? me.label : 'Guard'}</h1><${Leave} /></header>
    <${Alerts} />
    ${scene.value
      ? me
        ? html`<${Field} me=${me} />`
        : html`<main id="main"><${Join} /></main>`
      : html`<main id="main"><p class="soft">Waiting for the console …</p></main>`}
    <${EmergencyFooter} />
  </div>`;
}

function Leave() {
  if (!guard.value) return html`<span></span>`;
  return html`<button type="button" class="plain leave" onClick=${() => act('guard_leave')}>Leave</button>`;
}

function Alerts() {
  const lost = connection.value !== 'open' && connection.value !== 'connecting';
  const over = lost && connection.value !== 'lost' ? `The simulation has ended: ${connection.value}` : '';
  const texts = [lost && (over || 'link lost: the console cannot be reached. Trying again …'), guard.value?.alert];
  return html`<div class="alerts" role="alert">
    <${Notices} others=${texts} />
    ${texts.filter(Boolean).map((text) => html`<p class="warning" key=${text}>${text}</p>`)}
  </div>`;
}

/** Selection of the guard to play. */
function Join() {
  if (!mayDrive.value) return html`<p>This address is view-only. Scan the code for phones.</p>`;
  const free = playedGuards.value;
  if (!free.length) return html`<p>${NO_PLAYED_GUARD}</p>`;
  return html`<h2>Who are you?</h2>
    <div class="menu">${free.map(
      (one) => html`<button type="button" class="big" key=${one.i} disabled=${!maySteer.value}
        onClick=${() => act('guard_join', { guard: one.label })}>${one.label}</button>`,
    )}</div>`;
}

/** @param {{me: import('../lines.js').Guard}} props */
function Field({ me }) {
  const [placing, place] = useState(false);
  useEffect(() => follow(), []);
  const tapped = (/** @type {number} */ x, /** @type {number} */ y) => {
    place(false);
    act('guard_place', { x_m: x, y_m: y });
  };
  return html`<main id="main" class="field-page">
    <section class="map-region" aria-label="Map">
      <${MapBox} cones=${() => []} follows=${() => me.guard} goals=${goals} ways=${ways}
        keyboard=${false} legend=${false} onPlace=${placing ? tapped : undefined} />
    </section>
    <div class="order-side"><${OrderCard} me=${me} />
      <section class="panel" aria-label="Own position"><h2>Own position</h2>
        <${Own} me=${me} />
        <div class="buttons">
          <button type="button" aria-pressed=${placing} disabled=${!maySteer.value}
            onClick=${() => place(!placing)}>${placing ? 'Tap the map where you are' : 'I am here …'}</button>
          ${canLocate() && html`<button type="button" key="locate" aria-pressed=${locating.value}
            onClick=${() => (locating.value = !locating.value)}>By satellite</button>`}
        </div></section>
      <${Report} me=${me} /></div>
  </main>`;
}

/** Place of the order, as a goal on the map. */
function goals() {
  const order = guard.peek()?.order;
  if (!order) return [];
  return [{ x: order.x_m, y: order.y_m, radius: 0.8, name: capital(plain(order.kind)) }];
}

/** Route to the order, for the map. */
const ways = () => (guard.peek()?.order?.way_m ? [/** @type {any} */ (guard.peek()?.order).way_m] : []);

/** @param {{me: import('../lines.js').Guard}} props */
function Own({ me }) {
  useEvery(1000);
  const at = tracks.last(me.guard);
  return html`<p class="reported">${at ? `You are ${placeOf({ x_m: at.x, y_m: at.y })}.` : 'Your position is unknown.'}</p>`;
}

/** Distance beyond which an arrival has to be confirmed [m]: the event is hardly visible from there. */
const FAR_M = 10;
const SAYINGS = /** @type {[string, string][]} */ ([
  ['departed', 'Departed'],
  ['arrived', 'Arrived'],
  ['confirmed', 'Confirm'],
  ['refuted', 'Refute'],
  ['contained', 'Contained'],
]);

/**
 * Current order, with buttons for the guard's reports on it.
 * @param {{me: import('../lines.js').Guard}} props
 */
function OrderCard({ me }) {
  const [why, write] = useState('');
  const [declining, decline] = useState(false);
  const [doubted, doubt] = useState(false);
  const order = me.order;
  const off = !maySteer.value;
  const answer = async (/** @type {boolean} */ accept) => {
    const done = await act('guard_answer', { accept, reason: accept ? '' : why.trim() });
    if (done.ok) decline(false);
  };
  const isFar = order !== null && order.distance_m !== null && order.distance_m > FAR_M;
  const say = (/** @type {string} */ what) => {
    doubt(what === 'arrived' && isFar && !doubted);
    if (what !== 'arrived' || !isFar || doubted) act('guard_say', { what });
  };
  if (!order) {
    return html`<section class="panel" aria-label="Order" aria-live="polite"><h2>No order</h2>
      <p class="reported">${me.doing ? `You: ${me.doing}.` : 'Wait for an order.'}</p>
      <${Help} me=${me} /></section>`;
  }
  const far = order.distance_m === null ? '' : `, ${Math.round(order.distance_m)} m`;
  return html`<section class="panel order-card reported" aria-label="Order" aria-live="polite">
    <h2>${capital(plain(order.kind))} ${placeOf(order)}${far}</h2>
    <p>Event ${order.event}: ${plain(order.task)}. ${me.doing ? `You: ${me.doing}.` : ''}</p>
    ${!order.answered &&
    html`<div class="buttons two"><button type="button" class="big go" disabled=${off}
        onClick=${() => answer(true)}>Accept</button>
      <button type="button" class="big" disabled=${off} aria-expanded=${declining}
        onClick=${() => (declining ? answer(false) : decline(true))}>Decline</button></div>
      ${declining && html`<div class="field"><label for="why">Enter a reason, then press Decline again</label>
        <input id="why" type="text" maxlength="200" value=${why}
          onInput=${(/** @type {any} */ event) => write(event.currentTarget.value)} /></div>`}`}
    ${order.answered &&
    html`<div class="buttons two">${SAYINGS.map(
      ([what, name]) => html`<button type="button" class="big" key=${what} disabled=${off}
        onClick=${() => say(what)}>${name}</button>`,
    )}</div>`}
    ${doubted && isFar &&
    html`<div class="warning" role="alert"><span>You are ${Math.round(order.distance_m ?? 0)} m away from the
      event. Have you arrived?</span><div class="buttons">
      <button type="button" disabled=${off} onClick=${() => say('arrived')}>Yes, arrived</button>
      <button type="button" onClick=${() => doubt(false)}>Not yet</button></div></div>`}
    <${Help} me=${me} />
  </section>`;
}

/**
 * Button to request help for the guard; pressing it again withdraws the request.
 * @param {{me: import('../lines.js').Guard}} props
 */
function Help({ me }) {
  const asked = me.doing === 'needs help';
  return html`<button type="button" class="big help-me" disabled=${!maySteer.value} aria-pressed=${asked}
    onClick=${() => act('guard_say', { what: 'help' })}>${asked ? 'Help is no longer needed' : 'Help'}</button>`;
}
