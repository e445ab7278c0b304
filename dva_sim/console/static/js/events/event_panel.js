/** Event panel: the state of one event, the policy's proposal, and all available actions. */
import { html, useRef, useState } from '../../vendor/preact.js';
import { mayDispatch, maySteer, maySupervise, modeOf, robots, rowOf, selection, thingNamed } from '../store.js';
import { act } from '../net/actions.js';
import { ageOf } from '../net/world_time.js';
import { isOpen } from '../map/shown.js';
import { chooseRobots } from '../shell/route.js';
import { SeverityMark, StateMark } from '../ui/icon.js';
import { ageText, capital, plain } from '../ui/words.js';
import { assignTo, nearestGuard, nearestRobot, ProposalPanel } from './proposal.js';
import { inHand, reason } from './shared.js';

/** @typedef {import('../lines.js').SiteEvent} SiteEvent */

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
    ${mayDispatch.value && html`<${ProposalPanel} event=${event} />`}
    ${mayDispatch.value && html`<${Doing} key=${event.number} event=${event} />`}
  </section>`;
}

/** @param {{event: SiteEvent}} props */
function Facts({ event }) {
  const seen = event.acknowledged;
  const last = event.decided;
  return html`<dl class="facts reported">
    <dt>State</dt><dd><${StateMark} state=${event.state} />${plain(event.state)} for ${ageText(ageOf(event.since_ms))}</dd>
    <dt>Reported</dt><dd>${ageText(ageOf(event.reported_ms))} ago</dd>
    <dt>Acknowledged</dt><dd>${seen ? `by ${seen.label}, ${ageText(seen.at_ms - event.reported_ms)} after the report` : 'by nobody yet'}</dd>
    <dt>Sent</dt><dd>${event.assigned.join(', ') || 'nobody'}</dd>
    ${last && html`<dt>Decided</dt><dd>${plain(last.action)} by ${last.label}${last.reason ? `: ${last.reason}` : ''}</dd>`}
    ${event.note && html`<dt>Note</dt><dd class="note">${event.note}</dd>`}
  </dl>`;
}

/** @param {{event: SiteEvent}} props */
function Doing({ event }) {
  const [result, setResult] = useState('');
  const field = useRef(/** @type {HTMLInputElement | null} */ (null));
  const words = reason.value.trim();
  const about = { event: event.number, decisions: event.decisions ?? null };
  const ask = async (/** @type {import('../net/actions.js').Action} */ what, /** @type {object} */ more) => {
    const done = await act(what, more);
    setResult(done.ok ? done.text : '');
    if (done.ok) reason.value = '';
  };
  const withWords = (/** @type {() => void} */ then) => () => {
    if (words) then();
    else {
      setResult('Enter a reason or note first.');
      field.current?.focus();
    }
  };
  const off = !maySteer.value;
  const over = !isOpen(event);
  return html`<div class="doing">
    <label for="reason">Reason or note</label>
    <input id="reason" ref=${field} type="text" maxlength="256" autocomplete="off" value=${reason.value}
      onInput=${(/** @type {any} */ typed) => (reason.value = typed.currentTarget.value)} />
    <div class="buttons" role="group" aria-label="What to do">
      ${!over && html`<${Sending} event=${event} off=${off} setResult=${setResult} />`}
      ${!over && sentTo(event).map((who, n) => html`<button type="button" disabled=${off} title=${`Calls ${who} off`}
        onClick=${() => ask('event_take_off', { ...about, device: who, reason: words })}>
        ${n ? `Take off ${who}` : 'Take off'}</button>`)}
      ${!over && html`<button type="button" disabled=${off}
        onClick=${withWords(() => ask('event_false_alarm', { ...about, reason: words }))}>False alarm</button>
      <button type="button" disabled=${off}
        onClick=${() => ask('event_escalate', { ...about, reason: words })}>Escalate</button>`}
      <button type="button" disabled=${off}
        onClick=${withWords(() => ask('event_note', { event: event.number, text: words }))}>Note</button>
    </div>
    ${maySupervise.value && html`<${TakeOver} off=${off} words=${words} event=${event} setResult=${setResult} />`}
    <p role="status" aria-label="Done">${result}</p></div>`;
}

/** Robots and guards assigned to an event; drivers are left out. @param {SiteEvent} event */
const sentTo = (event) =>
  event.assigned.filter((who) => ['robot', 'guard'].includes(thingNamed(who)?.kind ?? ''));

/** Idle robot for a mission; the policy may not propose it, but a mission needs no driver. */
const idleRobot = () =>
  robots.value.find((robot) => modeOf(robot.i) === 'Idle' && !rowOf(robot.i)?.holder)?.label ?? '';

/** @param {{event: SiteEvent, off: boolean, setResult: (text: string) => void}} props */
function Sending({ event, off, setResult }) {
  const guard = nearestGuard.value;
  const robot = nearestRobot.value || idleRobot();
  const send = async () => {
    const done = await assignTo(event, guard);
    setResult(done.ok ? done.text : '');
  };
  const mission = async () => {
    const done = await act('mission', { robot, event: event.number });
    setResult(done.ok ? done.text : '');
  };
  return html`<button type="button" disabled=${off || !guard} title=${guard ? `Sends ${guard}` : 'No guard is available'}
      onClick=${send}>Send a guard</button>
    <button type="button" disabled=${off || !robot} title=${robot ? `${robot} goes there by itself` : 'No robot is available'}
      onClick=${mission}>Send a robot on a mission</button>`;
}

/** @param {{off: boolean, words: string, event: SiteEvent, setResult: (text: string) => void}} props */
function TakeOver({ off, words, event, setResult }) {
  const here = robots.value.filter((robot) => event.assigned.includes(robot.label));
  const [picked, pick] = useState('');
  const label = picked || (here[0] ?? robots.value[0])?.label || '';
  const take = async () => {
    setResult('');
    const done = await act('take_over', { robot: label, reason: words || 'taken over by hand' });
    if (!done.ok) return;
    selection.value = null;
    chooseRobots([label]);
  };
  return html`<div class="take-over"><label for="take-over">Robot</label>
    <select id="take-over" value=${label} onInput=${(/** @type {any} */ event) => pick(event.currentTarget.value)}>
      ${robots.value.map((robot) => html`<option value=${robot.label} selected=${robot.label === label}>
        ${robot.label}${holderText(robot.i)}</option>`)}</select>
    <button type="button" disabled=${off || !label} title="You drive it yourself" onClick=${take}>Take over</button></div>`;
}

/** @param {number} i */
function holderText(i) {
  const row = rowOf(i);
  const holder = row?.holder_label || row?.holder;
  return holder ? `, held by ${holder}` : '';
}
