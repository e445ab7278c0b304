/** Selection and order of the events, things and rooms that pages show. */
import { events, scene, tracks } from '../store.js';

const CLOSED = new Set(['contained', 'refuted', 'expired']);
const RANKS = ['critical', 'high', 'medium', 'low'];

/** @param {import('../lines.js').SiteEvent} event */
export const isOpen = (event) => !(event.over ?? CLOSED.has(event.state));

/** Events in display order: open first, then the most severe, then the oldest. */
export function eventsInOrder() {
  return [...events.value].sort(
    (a, b) =>
      Number(isOpen(b)) - Number(isOpen(a)) ||
      RANKS.indexOf(a.severity) - RANKS.indexOf(b.severity) ||
      a.number - b.number,
  );
}

/** Text for a list without open events. */
export const noEventText = () =>
  events.value.length === 0
    ? 'Nothing has been reported.'
    : `No event is open; ${events.value.length} ${events.value.length === 1 ? 'is' : 'are'} closed.`;

/** Number of open events of each severity. */
export function alarms() {
  const counts = /** @type {Record<string, number>} */ ({});
  for (const rank of RANKS) counts[rank] = 0;
  for (const event of events.value) if (isOpen(event)) counts[event.severity] += 1;
  return counts;
}

/** @param {string[]} kinds in the order of drawing */
export function thingsOf(kinds) {
  const things = scene.peek()?.things ?? [];
  return kinds.flatMap((kind) => things.filter((thing) => thing.kind === kind));
}

/**
 * The room of a place, in words.
 * @param {number} x
 * @param {number} y
 */
export function roomAt(x, y) {
  const rooms = scene.peek()?.site.rooms ?? [];
  const inside = rooms.filter(
    (room) =>
      contains(room.polygon_m, x, y) && !room.holes_m.some((hole) => contains(hole, x, y)),
  );
  return (inside.find((room) => !room.outdoor) ?? inside[0])?.name ?? '';
}

/**
 * Location of something in words: its room, else its coordinates.
 * @param {{x_m: number, y_m: number, room?: string | null}} what
 */
export function placeOf(what) {
  const room = what.room || roomAt(what.x_m, what.y_m);
  return room ? `in ${room}` : `at ${what.x_m.toFixed(0)} m, ${what.y_m.toFixed(0)} m`;
}

/** @param {number} i */
export function roomOf(i) {
  const place = tracks.last(i);
  return place ? roomAt(place.x, place.y) : '';
}

/**
 * @param {number[][]} polygon
 * @param {number} x
 * @param {number} y
 */
function contains(polygon, x, y) {
  let inside = false;
  for (let n = 0, before = polygon.length - 1; n < polygon.length; before = n, n += 1) {
    const [x1, y1] = polygon[n];
    const [x2, y2] = polygon[before];
    if (y1 > y !== y2 > y && x < ((x2 - x1) * (y - y1)) / (y2 - y1) + x1) inside = !inside;
  }
  return inside;
}
