/** Missions by hand: where a robot in hand is to go by itself, how far it is, and the end of it. */
import { computed, html, signal, useState } from '../../vendor/preact.js';
import { driveOf, maySteer, seat } from '../store.js';
import { act } from '../net/actions.js';
import { eventsInOrder, isOpen, placeOf } from '../map/shown.js';
import { Choice } from '../ui/fields.js';
import { capital, plain } from '../ui/words.js';

/** @typedef {import('../lines.js').Thing} Thing */

const KINDS = /** @type {[string, string][]} */ ([
  ['go_to', 'Go to a place'],
  ['patrol', 'Patrol places'],
  ['inspect', 'Inspect an event'],
  ['return_to_base', 'Return to base'],
]);
const STATES = /** @type {Record<string, string>} */ ({
  none: 'No mission',
  under_way: 'Under way',
  waiting: 'Waiting',
  replanning: 'Looking for another way',
  done: 'Done',
  failed: 'Ended early',
});
const GOES_ON = ['under_way', 'waiting', 'replanning'];
const MAX_PLACES = 64;

const kind = signal('go_to');
const places = signal(/** @type {number[][]} */ ([]));
const isPlaced = computed(() => ['go_to', 'patrol'].includes(kind.value));

/** Robot in hand whose permission includes missions. @param {number} i */
export const hasMissions = (i) => ['missions', 'both'].includes(driveOf(i)?.level ?? '');

/** Take a tapped place: the goal, or one more of a patrol. @param {number} x @param {number} y */
export function place(x, y) {
  if (isPlaced.peek()) places.value = kind.peek() === 'patrol' ? [...places.peek(), [x, y]].slice(-MAX_PLACES) : [[x, y]];
}

/** Places of the mission, for the map. @returns {import('../types.js').Goal[]} */
export const missionGoals = () =>
  isPlaced.peek() && seat.peek()?.drives.some(({ i }) => i !== null && hasMissions(i)) ? places.peek().map(([x, y], n) => ({ x, y, radius: 0.8, name: kind.peek() === 'patrol' ? String(n + 1) : '' })) : [];

/** @param {{robot: Thing}} props */
export function Missions({ robot }) {
  const [chosen, choose] = useState('');
  void seat.value;
  const mission = driveOf(robot.i)?.mission ?? null;
  const open = eventsInOrder().filter(isOpen);
  const event = open.find((one) => String(one.number) === chosen) ?? open[0];
  const isReady = isPlaced.value ? places.value.length > 0 : kind.value !== 'inspect' || Boolean(event);
  const order = () =>
    act('mission_order', {
      robot: robot.i,
      what: kind.value,
      ...(isPlaced.value && { places_m: places.value }),
      ...(kind.value === 'inspect' && event && { event: event.number }),
    });
  return html`<section class="panel mission" aria-label="Missions"><h2>Mission of ${robot.label}</h2>
    <p role="status" aria-label="Progress" class="reported">${progress(mission)}</p>
    <${Choice} name="Mission" value=${kind.value} options=${KINDS} onInput=${(/** @type {string} */ value) => (kind.value = value)} />
    ${isPlaced.value && html`<p class="soft" key="places">${placesText()}
      ${places.value.length > 0 && html` <button type="button" class="plain" key="clear" onClick=${() => (places.value = [])}>Clear places</button>`}</p>`}
    ${kind.value === 'inspect' && html`<${Choice} key="event" name="Event" value=${String(event?.number ?? '')} onInput=${choose}
      options=${open.map((one) => [String(one.number), `${one.number} ${capital(plain(one.kind))} ${placeOf(one)}`])} />`}
    <div class="buttons">${mission && GOES_ON.includes(mission.state)
      ? html`<button type="button" key="cancel" class="big" disabled=${!maySteer.value}
          onClick=${() => act('mission_cancel', { robot: robot.i })}>Cancel mission</button>`
      : html`<button type="button" key="send" class="big go" disabled=${!maySteer.value || !isReady} onClick=${order}>Send ${robot.label}</button>`}
    </div></section>`;
}

/** @param {import('../lines.js').Mission | null} mission */
function progress(mission) {
  if (!mission) return 'No mission yet.';
  const { state, places_left: left, reason } = mission;
  const far = GOES_ON.includes(state) ? `, ${left} ${left === 1 ? 'place' : 'places'} left` : '';
  return `${STATES[state]}${far}${reason && `: ${reason}`}.`;
}

function placesText() {
  if (!places.value.length) return kind.value === 'patrol' ? 'Tap the places on the map, in their order.' : 'Tap the place on the map.';
  return places.value.map(([x, y]) => placeOf({ x_m: x, y_m: y })).join(', ');
}
