/** Figures on each robot's commands in the last minute, recorded whatever page is shown. */
import { driveOf, robots, rowOf } from '../store.js';
import { isStale, worldNow } from '../net/world_time.js';
import { History } from '../charts/history.js';

export const SPAN_S = 60;
const EVERY_MS = 500;
const MAX_ROBOTS = 50;

/** @typedef {{title: string, unit: string, least: number, read: (i: number) => number | null}} Kind */

export const KINDS = /** @type {Kind[]} */ ([
  { title: 'Command age', unit: 'ms', least: 100, read: (i) => driveOf(i)?.command_age_ms ?? null },
  { title: 'Round trip', unit: 'ms', least: 100, read: (i) => driveOf(i)?.round_trip_ms ?? null },
  { title: 'Commands applied', unit: 'per second', least: 10, read: (i) => rowOf(i)?.commands_hz ?? null },
  { title: 'Commands waiting in the robot', unit: '', least: 5, read: (i) => rowOf(i)?.queue ?? null },
  { title: 'Lost on the link', unit: 'so far', least: 5, read: (i) => rowOf(i)?.lost ?? null },
]);

/** @type {History[]} */
let histories = [];
/** @type {number[]} */
let known = [];

/** Start sampling. */
export function keepSampling() {
  window.setInterval(sample, EVERY_MS);
}

function sample() {
  const now = robots.peek().slice(0, MAX_ROBOTS).map((robot) => robot.i);
  if (!now.length || isStale.peek()) return;
  if (now.join() !== known.join()) {
    known = now;
    histories = KINDS.map(() => new History(now.length, SPAN_S + 10));
  }
  const time = worldNow() / 1000;
  KINDS.forEach((kind, n) => histories[n].add(time, known.map(kind.read)));
}

/**
 * Times and the values of some robots, as charts read them.
 * @param {number} kind
 * @param {number[]} wanted
 */
export function read(kind, wanted) {
  const columns = histories[kind]?.columns ?? [[]];
  const none = columns[0].map(() => /** @type {any} */ (null));
  return [columns[0].slice(), ...wanted.map((i) => columns[known.indexOf(i) + 1]?.slice() ?? none)];
}
