/** Form for an event at a place: a click on the map beside it, a room, or two numbers. */
import { html, useState } from '../../vendor/preact.js';
import { maySteer, scene } from '../store.js';
import { act } from '../net/actions.js';
import { placeOf } from '../map/shown.js';
import { Choice, Field, wrongNumber } from '../ui/fields.js';
import { KINDS, SEVERITIES } from '../ui/report_choices.js';
import { place, raising, select } from './shared.js';

/** The panel. */
export function Raise() {
  return html`<section class="panel raise" aria-label="Raise an event">
    <h2>Raise an event</h2><p class="soft">Click on the map where it is, or choose a room.</p>
    <${Form} /></section>`;
}

/** Place of the new event [m]: the chosen one, else where robots get in the first room, else the middle. */
function where() {
  return place.value ?? rooms().find((room) => room.place_m)?.place_m ?? middle();
}

const rooms = () => (scene.value?.site.rooms ?? []).filter((room) => !room.outdoor);

/** @returns {[number, number]} */
function middle() {
  const [left, low, right, high] = scene.value?.site.extent_m ?? [0, 0, 0, 0];
  return [(left + right) / 2, (low + high) / 2];
}

function Form() {
  const [kind, setKind] = useState('fire');
  const [severity, setSeverity] = useState('high');
  const [result, setResult] = useState('');
  const [x, y] = where();
  const [left, low, right, high] = scene.value?.site.extent_m ?? [0, 0, 0, 0];
  const wrong = [wrongNumber(`${x}`, left, right, 'm'), wrongNumber(`${y}`, low, high, 'm')];
  const raise = async () => {
    setResult('');
    const done = await act('event_raise', { kind, severity, x_m: x, y_m: y });
    if (!done.ok) return;
    setResult(done.text);
    if (done.event) select(done.event);
  };
  return html`<div class="report">
    <${Choice} name="Kind" value=${kind} options=${KINDS} onInput=${setKind} />
    <${Choice} name="Severity" value=${severity} options=${SEVERITIES} onInput=${setSeverity} />
    <${Rooms} refuse=${setResult} />
    <${Field} name="x, m" mode="decimal" value=${shown(x)} wrong=${wrong[0]} onInput=${set(0)} />
    <${Field} name="y, m" mode="decimal" value=${shown(y)} wrong=${wrong[1]} onInput=${set(1)} />
    <button type="button" class="wide" disabled=${!maySteer.value || Boolean(wrong[0] || wrong[1])}
      onClick=${raise}>Raise event</button>
    <button type="button" onClick=${() => (raising.value = false)}>Cancel</button>
    <p class="soft">${wrong[0] || wrong[1] ? '' : `Location: ${placeOf({ x_m: x, y_m: y })}.`}</p>
    <p role="status" aria-label="Raised">${result}</p></div>`;
}

/** @param {number} value */
const shown = (value) => (Number.isFinite(value) ? `${Number(value.toFixed(2))}` : '');

/** @param {0 | 1} axis */
const set = (axis) => (/** @type {string} */ text) => {
  const at = /** @type {[number, number]} */ ([...where()]);
  at[axis] = text.trim() ? Number(text.replace(',', '.')) : NaN;
  place.value = at;
};

/** @param {{refuse: (text: string) => void}} props */
function Rooms({ refuse }) {
  const names = [...new Set(rooms().map((room) => room.name))];
  if (!names.length) return null;
  const go = (/** @type {string} */ name) => {
    const room = rooms().find((each) => each.name === name);
    if (room?.place_m) place.value = [room.place_m[0], room.place_m[1]];
    refuse(room && !room.place_m ? `No robot gets into ${name}: click on the map where it is.` : '');
  };
  const options = /** @type {[string, string][]} */ ([['', 'choose a room'], ...names.map((n) => [n, n])]);
  return html`<${Choice} name="Room" value="" options=${options} onInput=${go} />`;
}
