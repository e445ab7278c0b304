/** Card with details of the selection. */
import { html, useEffect } from '../../vendor/preact.js';
import { doingOf, isAttached, modeOf, rowOf, rows, selection, thingAt, tracks } from '../store.js';
import { watch } from '../net/sockets.js';
import { ageOf } from '../net/world_time.js';
import { chooseRobots } from '../shell/route.js';
import { useEvery } from '../ui/every.js';
import { Icon, ModeMark, SeverityMark, StateMark } from '../ui/icon.js';
import { ageText, capital, percentText, plain } from '../ui/words.js';
import { eventNumbered } from './lists.js';
import { roomOf } from './shown.js';

/** The card, if anything is selected. */
export function Card() {
  useEvery(500);
  const chosen = selection.value;
  if (!chosen) return null;
  const body = chosen.kind === 'event' ? eventCard(chosen.key) : thingCard(chosen.key);
  if (!body) return null;
  return html`<aside class="card reported" aria-label="What is chosen">
    <button type="button" class="close" aria-label="Close" onClick=${() => (selection.value = null)}>
      <${Icon} name="x" /></button>${body}</aside>`;
}

/** @param {number} key */
function eventCard(key) {
  const event = eventNumbered(key);
  if (!event) return null;
  return html`<h2><${SeverityMark} severity=${event.severity} />${event.number} ${capital(plain(event.kind))}</h2>
    <dl>
      <dt>State</dt><dd><${StateMark} state=${event.state} />${event.state}</dd>
      <dt>Severity</dt><dd>${event.severity}</dd>
      <dt>Place</dt><dd>${event.room || 'outdoors'} (${event.x_m.toFixed(1)} m, ${event.y_m.toFixed(1)} m)</dd>
      <dt>Reported</dt><dd>${ageText(ageOf(event.reported_ms))} min ago</dd>
      <dt>Sent</dt><dd>${event.assigned.join(', ') || 'nobody'}</dd>
    </dl>`;
}

/** @param {number} key */
function thingCard(key) {
  const thing = thingAt(key);
  if (!thing) return null;
  const place = tracks.last(key);
  const speed = place ? `${place.speed.toFixed(2)} m/s` : 'has left the site';
  const where = place
    ? `${roomOf(key)} (${place.x.toFixed(1)} m, ${place.y.toFixed(1)} m)`
    : '–';
  const robot = thing.kind === 'robot';
  return html`<h2>${robot ? html`<${ModeMark} mode=${modeOf(key)} />` : html`<span class=${`dot ${thing.kind}`}></span>`}${thing.label}</h2>
    <dl>
      ${robot ? robotLines(key) : html`<dt>Doing</dt><dd>${doingOf(key) || '–'}</dd>`}
      <dt>Speed</dt><dd>${speed}</dd>
      <dt>Place</dt><dd>${where}</dd>
    </dl>
    ${robot && isAttached.value && html`<${Watched} i=${key} />`}
    ${robot && html`<button type="button" key="drive" class="wide" onClick=${() => chooseRobots([thing.label])}>
      <${Icon} name="gamepad-2" />Look through its camera</button>`}`;
}

/** Subscribe to a robot's sensors while the card shows it. @param {{i: number}} props */
function Watched({ i }) {
  useEffect(() => {
    watch([i]);
    return () => watch([]);
  }, [i]);
  return null;
}

/** @param {number} key */
function robotLines(key) {
  void rows.value;
  const row = rowOf(key);
  return html`<dt>Mode</dt><dd>${modeOf(key)}</dd>
    <dt>Battery</dt><dd>${isAttached.value ? 'unknown' : percentText(row?.battery)}</dd>
    <dt>Pattern</dt><dd>${row?.pattern ?? (isAttached.value ? 'unknown' : '–')}</dd>
    <dt>Held by</dt><dd>${row?.holder_label || row?.holder || 'nobody'}</dd>
    ${isAttached.value && html`<dt>Camera</dt><dd>${row?.camera ?? 'unknown'}</dd>
      <dt>Sensors</dt><dd>${row?.sensors?.join(', ') || 'unknown'}</dd>`}
    ${row?.stop_reason && html`<dt>Stopped</dt><dd>${row.stop_reason}</dd>`}`;
}
