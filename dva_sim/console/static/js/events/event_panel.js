/** Event in hand: its state, who could go, one button for what is next, and the other decisions. */
import { html, useEffect, useRef, useState } from '../../vendor/preact.js';
import { alarmList, control, isAttached, mayDispatch, maySteer, maySupervise, selection, thingNamed } from '../store.js';
import { act } from '../net/actions.js';
import { ageOf } from '../net/world_time.js';
import { isOpen } from '../map/shown.js';
import { chooseRobots } from '../shell/route.js';
import { SeverityMark, StateMark } from '../ui/icon.js';
import { ageText, capital, plain } from '../ui/words.js';
import { History, Instructions, useDetails } from './details.js';
import { HandOver } from './handing_over.js';
import { assignTo, candidateOf, chosen, estimateOf, isPicked, ProposalPanel, waysOf } from './proposal.js';
import { acknowledge, inHand, isUnseen, ownerOf, ownRoom, reason, shelfOf } from './shared.js';
import { Shelve } from './shelve.js';

/** @typedef {import('../lines.js').SiteEvent} SiteEvent */
/** @typedef {{ok: boolean, text: string}} Done */

const SETTLE_MS = 500;

/** The panel. */
export function EventPanel() {
  const event = inHand.value;
  if (!event) {
    return html`<section class="panel" aria-label="Event in hand"><h2>No event</h2>
      <p class="none">Nothing has been reported.</p></section>`;
  }
  return html`<section class="panel event-panel" aria-label="Event in hand">
    <h2><${SeverityMark} severity=${event.severity} quiet=${!isOpen(event)} />${event.number}
      ${' '}${capital(plain(event.kind))}, ${event.room || 'outdoors'}</h2>
    <${Facts} event=${event} />
    ${mayDispatch.value && html`<${Decisions} key=${event.number} event=${event} />`}
    <${Details} key=${`details ${event.number}`} event=${event} />
  </section>`;
}

/** Instructions, handing over and history of the event. @param {{event: SiteEvent}} props */
function Details({ event }) {
  const details = useDetails(event.number, [event.state, event.decisions, event.severity, event.note].join());
  return html`<${Instructions} event=${event.number} details=${details} />
    ${isOpen(event) && ownRoom.value && html`<details><summary>Hand over</summary><${HandOver} event=${event.number} /></details>`}
    <details open><summary>History${details && ` (${details.history.length})`}</summary><${History} details=${details} /></details>`;
}

/** @param {{event: SiteEvent}} props */
function Facts({ event }) {
  const seen = event.acknowledged;
  const last = event.decided;
  const shelf = isOpen(event) ? shelfOf(event) : undefined;
  const owner = ownerOf(event);
  return html`<dl class="facts reported">
    <dt>State</dt><dd><${StateMark} state=${event.state} />${plain(event.state)} for ${ageText(ageOf(event.since_ms))},
      reported ${ageText(ageOf(event.reported_ms))} ago</dd>
    <dt>Acknowledged</dt><dd>${seen ? `by ${seen.label}, ${ageText(seen.at_ms - event.reported_ms)} after the report` : 'by nobody yet'}</dd>
    ${owner && owner !== seen?.label && html`<dt>Answers for it</dt><dd>${owner}</dd>`}
    ${shelf && html`<dt>Shelved</dt><dd>by ${shelf.shelved_by}: ${shelf.shelved_why}</dd>`}
    <dt>Sent</dt><dd>${[...new Set(event.assigned)].join(', ') || 'nobody'}</dd>
    ${last && html`<dt>Decided</dt><dd>${plain(last.action)} by ${last.label}${last.reason ? `: ${last.reason}` : ''}</dd>`}
    ${event.note && html`<dt>Note</dt><dd class="note">${event.note}</dd>`}
  </dl>`;
}

/** @param {{event: SiteEvent}} props */
function Decisions({ event }) {
  const [result, setResult] = useState('');
  const field = useRef(/** @type {HTMLInputElement | null} */ (null));
  const words = reason.value.trim();
  const about = { event: event.number, decisions: event.decisions ?? null };
  const tell = (/** @type {Done} */ done) => {
    setResult(done.ok ? done.text : '');
    if (done.ok) reason.value = '';
  };
  const ask = async (/** @type {import('../net/actions.js').Action} */ what, /** @type {object} */ more) =>
    tell(await act(what, more));
  const withWords = (/** @type {() => void} */ then) => () => {
    if (words) return then();
    setResult('Enter a reason or note first.');
    return field.current?.focus();
  };
  const off = !maySteer.value;
  const alarm = alarmList.value.alarms.find((one) => one.event === event.number && one.count === 1);
  const open = isOpen(event);
  return html`${open && html`<${ProposalPanel} event=${event} /><${NextStep} event=${event} tell=${tell} />`}
    <div class="doing">
    <label for="reason">Reason or note</label>
    <input id="reason" ref=${field} type="text" maxlength="256" autocomplete="off" value=${reason.value}
      onInput=${(/** @type {any} */ typed) => (reason.value = typed.currentTarget.value)} />
    <div class="buttons" role="group" aria-label="Other decisions">
      ${open && sentTo(event).map((who) => html`<button type="button" disabled=${off} key=${who}
        onClick=${() => ask('event_take_off', { ...about, device: who, reason: words })}>Take off ${who}</button>
        ${maySupervise.value && isRobot(who) && html`<button type="button" key="take-over" disabled=${off} title="You drive it yourself"
          data-deed="take" onClick=${async () => tell(await drive(who, words))}>Take over ${who}</button>`}`)}
      ${open && html`<button type="button" key="false-alarm" disabled=${off}
        onClick=${withWords(() => ask('event_false_alarm', { ...about, reason: words }))}>False alarm</button>
      <button type="button" disabled=${off}
        onClick=${() => ask('event_escalate', { ...about, reason: words })}>Escalate</button>`}
      <button type="button" disabled=${off}
        onClick=${withWords(() => ask('event_note', { event: event.number, text: words }))}>Note</button>
      ${open && alarm && html`<${Shelve} alarm=${alarm} />`}
    </div>
    <p role="status" aria-label="Done">${result}</p></div>`;
}

const WAYS = /** @type {Record<string, string>} */ ({
  order: 'by the DVA’s order', mission: 'by itself', drive: 'I drive',
});

/** Next step of an open event: sending the chosen candidate, or acknowledging. @param {{event: SiteEvent, tell: (done: Done) => void}} props */
function NextStep({ event, tell }) {
  const whom = chosen.value;
  const ways = waysOf(candidateOf(whom));
  const [wanted, want] = useState('');
  const way = ways.includes(wanted) ? wanted : ways[0];
  const sent = sentTo(event);
  const isSent = sent.includes(whom);
  const settled = useSettled(`${event.number} ${isPicked.value || whom}`);
  const off = !maySteer.value;
  const send = async () => {
    if (way === 'drive') return tell(await drive(whom, reason.peek().trim(), event.number));
    const about = { event: event.number, decisions: event.decisions ?? null, reason: reason.peek().trim() };
    if (way === 'mission') return tell(await act('mission', { robot: whom, ...about }));
    return tell(await assignTo(event, whom));
  };
  const find = async (/** @type {string} */ finding) =>
    tell(await act('mission_found', { event: event.number, finding }));
  const looks = isOwnMission(event);
  const isNext = Boolean(whom) && !sent.length; // to send another one takes the first one off
  return html`<div class="next-step">
    ${looks && html`<div class="buttons" role="group" aria-label="Finding">
      <button type="button" class="primary" disabled=${off} onClick=${() => find('confirmed')}>Confirm</button>
      <button type="button" disabled=${off} onClick=${() => find('refuted')}>Refute</button></div>`}
    ${ways.length > 1 && !isSent && html`<fieldset><legend class="hidden">How</legend>${ways.map((one) => html`<label key=${one}>
      <input type="radio" name="way" checked=${one === way} onInput=${() => want(one)} />${WAYS[one]}</label>`)}</fieldset>`}
    <div class="buttons">
      ${whom && !isSent && html`<button type="button" key="send" class=${isNext ? 'primary' : ''} data-deed="send" disabled=${off || !settled} onClick=${send}>
        ${way === 'drive' ? `Drive ${whom} there` : `Send ${estimateOf(whom, sent[0])}`}</button>`}
      ${!whom && !sent.length && html`<p class="none">Nobody can go.</p>`}
      ${isUnseen(event) && html`<button type="button" key="acknowledge" class=${looks || isNext ? '' : 'primary'} disabled=${off}
        onClick=${() => acknowledge(event)}>Acknowledge</button>`}
    </div></div>`;
}

/**
 * False for a moment after something has appeared: a click on what stood there before is not for it.
 * @param {string} key
 */
function useSettled(key) {
  const [settled, settle] = useState('');
  useEffect(() => {
    const timer = window.setTimeout(() => settle(key), SETTLE_MS);
    return () => window.clearTimeout(timer);
  }, [key]);
  return settled === key;
}

/**
 * Take a robot from its holder, with its task or to an event, and open its driving page.
 * @param {string} robot
 * @param {string} words
 * @param {number} [event]
 */
async function drive(robot, words, event) {
  if (maySupervise.peek()) {
    const to = event === undefined ? {} : { event };
    const done = await act('take_over', { robot, reason: words || 'taken over by hand', ...to });
    if (!done.ok) return done;
  }
  selection.value = null;
  chooseRobots([robot]);
  return { ok: true, text: '' };
}

/** True where a robot looks by itself for this page's person; at a remote DVA, as far as labels tell. @param {SiteEvent} event */
function isOwnMission(event) {
  const senders = event.assigned.filter((who) => !thingNamed(who));
  if (!isAttached.value) return event.assigned.some(isRobot) && senders.includes(ownRoom.value);
  const others = (control.value?.rooms ?? []).map((room) => room.label).filter((label) => label !== ownRoom.value);
  return event.assigned.some(isRobot) && senders.some((who) => !others.includes(who));
}

/** @param {string} who */
const isRobot = (who) => thingNamed(who)?.kind === 'robot';

/** Robots and guards assigned to an event; drivers are left out. @param {SiteEvent} event */
const sentTo = (event) =>
  [...new Set(event.assigned)].filter((who) => ['robot', 'guard'].includes(thingNamed(who)?.kind ?? ''));
