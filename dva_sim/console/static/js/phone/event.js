/** An event on the phone: what is known of it, its place, the picture of who goes, and the way there. */
import { html, useEffect, useState } from '../../vendor/preact.js';
import { events, guard, isAttached, maySteer, modeOf, notice, robots, rowOf, rows, tracks } from '../store.js';
import { act } from '../net/actions.js';
import { ageOf } from '../net/world_time.js';
import { watch } from '../net/sockets.js';
import { CameraPicture } from '../drive/camera.js';
import { playedGuards } from '../guard/played.js';
import { MapBox } from '../map/map_box.js';
import { isOpen, placeOf } from '../map/shown.js';
import { SeverityMark } from '../ui/icon.js';
import { ageText, capital, plain } from '../ui/words.js';
import { holds, isKnown, robot } from './drive.js';
import { subject } from './screens.js';

/** @typedef {import('../lines.js').SiteEvent} SiteEvent */

/** The screen. */
export function EventScreen() {
  void rows.value;
  const event = events.value.find((one) => String(one.number) === subject.value);
  if (!event) return html`<p>There is no event ${subject.value}. <a href="#/main">All events</a></p>`;
  const goes = robots.value.find((one) => event.assigned.includes(one.label));
  return html`<section class="panel" aria-label=${`Event ${event.number}`}>
      <h2><${SeverityMark} severity=${event.severity} /> ${event.number} ${capital(plain(event.kind))} ${placeOf(event)}</h2>
      <dl class="facts reported">
        <dt>State</dt><dd>${plain(event.state)} for ${ageText(ageOf(event.since_ms))}</dd>
        <dt>Reported</dt><dd>${ageText(ageOf(event.reported_ms))} ago</dd>
        <dt>Severity</dt><dd>${event.severity}</dd>
        <dt>Goes there</dt><dd>${event.assigned.join(', ') || 'nobody'}</dd>
        ${event.note && html`<dt>Note</dt><dd>${event.note}</dd>`}
      </dl></section>
    ${isOpen(event) && html`<${Way} event=${event} /><${OwnWay} event=${event} />`}
    <section class="map-region small" aria-label="Map">
      <${MapBox} cones=${() => (goes ? [goes.i] : [])} legend=${false} keyboard=${false}
        goals=${() => [{ x: event.x_m, y: event.y_m, radius: 0.8, name: '' }]} /></section>
    ${goes && html`<${Picture} key=${goes.i} robot=${goes} />`}`;
}

/** @param {{robot: import('../lines.js').Thing}} props */
function Picture({ robot: shown }) {
  useEffect(() => {
    watch([shown.i]);
    return () => watch([]);
  }, [shown.i]);
  return html`<section aria-label=${`Picture of ${shown.label}`}><${CameraPicture} robot=${shown} /></section>`;
}

/** Button that gets a robot and goes on to drive it. @param {{event: SiteEvent}} props */
function Way({ event }) {
  const free = freeRobots(event);
  const [wanted, want] = useState('');
  const [asking, ask] = useState(false);
  if (holds.value) {
    return html`<a class="big go" href="#/teleoperation">Drive there with ${robot.value?.label}</a>`;
  }
  if (!isKnown.value) return html`<a class="big go" href="#/authentication">Register to drive there</a>`;
  const chosen = free.find((one) => one.id === wanted) ?? free[0];
  if (!chosen) return html`<p class="soft">No robot is free to drive there.</p>`;
  const drive = async () => {
    ask(true);
    const done = await act('phone_permission', { device: chosen.id, level: 'teleoperation' });
    ask(false);
    if (done.ok) location.hash = '#/teleoperation';
    else notice.value = `No permission: ${done.text}`;
  };
  return html`<div class="buttons">
    <button type="button" class="big go" disabled=${asking || !maySteer.value} onClick=${drive}>Drive there with ${chosen.label}</button>
    ${free.length > 1 && html`<label class="field"><span>Another robot</span>
      <select value=${chosen.id} onChange=${(/** @type {any} */ change) => want(change.target.value)}>
        ${free.map((one) => html`<option key=${one.id} value=${one.id}>${one.label}</option>`)}</select></label>`}</div>`;
}

/** Button of a guard who goes there of their own accord. @param {{event: SiteEvent}} props */
function OwnWay({ event }) {
  const free = playedGuards.value;
  const [chosen, choose] = useState('');
  const [asking, ask] = useState(false);
  const label = guard.value?.label || chosen || free[0]?.label;
  if (!label) return null;
  if (guard.value && event.assigned.includes(label)) return html`<a class="big go" href="/guard">Follow the way there as ${label}</a>`;
  const go = async () => {
    ask(true);
    const joined = guard.peek() ? { ok: true } : await act('guard_join', { guard: label });
    const done = joined.ok && (await act('guard_go', { event: event.number }));
    ask(false);
    if (done && done.ok) location.href = '/guard';
  };
  const others = event.assigned.length ? ` instead of ${event.assigned.join(', ')}` : '';
  return html`<div class="buttons">
    <button type="button" class="big" key="go" disabled=${asking || !maySteer.value} onClick=${go}>I go${others}</button>
    ${!guard.value && html`<label class="field" key="who"><span>I am</span>
      <select aria-label="I am" value=${label} onChange=${(/** @type {any} */ change) => choose(change.target.value)}>
        ${free.map((one) => html`<option key=${one.i} value=${one.label}>${one.label}</option>`)}</select></label>`}</div>`;
}

/** Robots that nobody holds, the nearest first. @param {SiteEvent} event */
function freeRobots(event) {
  const isFree = (/** @type {any} */ one) => !rowOf(one.i)?.holder && (modeOf(one.i) === 'Idle' || isAttached.value);
  const far = (/** @type {any} */ one) => {
    const at = tracks.last(one.i);
    return at ? Math.hypot(at.x - event.x_m, at.y - event.y_m) : Infinity;
  };
  return robots.value.filter(isFree).sort((a, b) => far(a) - far(b));
}
