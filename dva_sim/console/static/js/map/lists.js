/** Events, robots and people as lists: the map for screen readers and keyboards. */
import { html } from '../../vendor/preact.js';
import { doingOf, events, modeOf, rowOf, rows, scene, selection } from '../store.js';
import { ageOf } from '../net/world_time.js';
import { ModeMark, SeverityMark, StateMark } from '../ui/icon.js';
import { ageText, capital, percentText, plain } from '../ui/words.js';
import { Regions } from './regions.js';
import { eventsInOrder, isOpen, roomOf } from './shown.js';

/** @typedef {import('../lines.js').SiteEvent} SiteEvent */
/** @typedef {import('../lines.js').Thing} Thing */

/** All of them. */
export function Lists() {
  return html`<div class="lists reported"><${Regions} /><${Events} /><${Robots} /><${People} kind="guard"
    title="Guards" /><${People} kind="bystander" title="Bystanders" /></div>`;
}

/** @param {import('../types.js').Selection} what */
function choose(what) {
  const same = selection.value?.kind === what?.kind && selection.value?.key === what?.key;
  selection.value = same ? null : what;
}

/** @param {'thing' | 'event'} kind @param {number} key */
const isChosen = (kind, key) => selection.value?.kind === kind && selection.value.key === key;

function Events() {
  const list = eventsInOrder();
  const open = list.filter(isOpen).length;
  return html`<section aria-label="Events">
    <h2>Events <span class="count">${open} open of ${list.length}</span></h2>
    ${list.length === 0 && html`<p class="none">Nothing has been reported.</p>`}
    <ul class="rows">${list.map((event) => html`<${EventRow} key=${event.number} event=${event} />`)}</ul>
  </section>`;
}

/** @param {{event: SiteEvent}} props */
function EventRow({ event }) {
  const open = isOpen(event);
  return html`<li><button type="button" class=${open ? 'row' : 'row over'}
    aria-pressed=${isChosen('event', event.number)}
    onClick=${() => choose({ kind: 'event', key: event.number })}>
    <${SeverityMark} severity=${event.severity} quiet=${!open} />
    <span class="what">${event.number} ${capital(plain(event.kind))}<small>${event.severity}${event.room ? `, ${event.room}` : ''}</small></span>
    <span class="state"><${StateMark} state=${event.state} />${event.state} <b>${open ? ageText(ageOf(event.since_ms)) : ''}</b>
      ${event.assigned.length > 0 && html`<small>${event.assigned.join(', ')}</small>`}</span>
  </button></li>`;
}

function Robots() {
  void rows.value;
  const robots = (scene.value?.things ?? []).filter((thing) => thing.kind === 'robot');
  return html`<section aria-label="Robots">
    <h2>Robots <span class="count">${robots.length}</span></h2>
    <ul class="rows">${robots.map((robot) => html`<${RobotRow} key=${robot.i} robot=${robot} />`)}</ul>
  </section>`;
}

/** @param {{robot: Thing}} props */
function RobotRow({ robot }) {
  const row = rowOf(robot.i);
  const mode = modeOf(robot.i);
  const low = (row?.battery ?? 1) < 0.25;
  return html`<li><button type="button" class="row" aria-pressed=${isChosen('thing', robot.i)}
    onClick=${() => choose({ kind: 'thing', key: robot.i })}>
    <${ModeMark} mode=${mode} />
    <span class="what">${robot.label}<small>${roomOf(robot.i)}</small></span>
    <span class="state">${mode}${row?.holder_label ? html` <small>${row.holder_label}</small>` : ''}
      <small class=${low ? 'low' : ''}>${row?.battery == null ? '' : `battery ${percentText(row.battery)}`}</small></span>
  </button></li>`;
}

/** @param {{kind: string, title: string}} props */
function People({ kind, title }) {
  void rows.value;
  const people = (scene.value?.things ?? []).filter((thing) => thing.kind === kind);
  if (!people.length) return null;
  const list = html`<ul class="rows">${people.map(
    (person) => html`<${PersonRow} key=${person.i} person=${person} />`,
  )}</ul>`;
  const head = html`${title} <span class="count">${people.length}</span>`;
  if (kind === 'guard') return html`<section aria-label=${title}><h2>${head}</h2>${list}</section>`;
  return html`<section aria-label=${title}><details><summary><h2>${head}</h2></summary>${list}
  </details></section>`;
}

/** @param {{person: Thing}} props */
function PersonRow({ person }) {
  return html`<li><button type="button" class="row" aria-pressed=${isChosen('thing', person.i)}
    onClick=${() => choose({ kind: 'thing', key: person.i })}>
    <span class=${`dot ${person.kind}`}></span>
    <span class="what">${person.label}<small>${roomOf(person.i)}</small></span>
    <span class="state">${doingOf(person.i)}</span>
  </button></li>`;
}

/** @param {number} key */
export const eventNumbered = (key) => events.value.find((event) => event.number === key);
