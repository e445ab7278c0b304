/**
 * The page's clocks: simulation time, extrapolated between messages, and the age of what is shown.
 *
 * All ages are computed here, so that they count on while nothing arrives. A component that reads
 * one renders again with it. Those that belong to simulated time stand still while it is paused.
 */
import { computed, effect, signal } from '../../vendor/preact.js';
import { clock, connection } from '../store.js';

const PULL = 0.05;
const TICK_MS = 100;
const STALE_S = 2; // without a message; the server answers a ping each second
let offset = NaN;
let pace = 1;
let jumped = 0;
let heard = -Infinity;
let newest = 0;

const tenths = signal(0);
const seconds = computed(() => Math.floor(tenths.value / 10));
window.setInterval(() => {
  if (!document.hidden) tenths.value += 1;
}, TICK_MS);

effect(() => {
  const { factor, paused, jumps = 0 } = clock.value;
  const next = paused ? 0 : factor;
  if (next !== pace || jumps !== jumped) {
    pace = next;
    jumped = jumps;
    offset = NaN;
  }
});

/**
 * Record the simulation time of a message.
 *
 * The message with the shortest delay gives the best estimate: others pull the estimate back only
 * slowly, so that a late one does not make a picture look younger than it is.
 * @param {number} t
 */
export function hear(t) {
  const now = performance.now();
  heard = now;
  newest = t;
  const latest = t - pace * now;
  offset = Number.isNaN(offset) || latest > offset ? latest : offset + PULL * (latest - offset);
}

/** Record the arrival of a message without a simulation time. */
export function hearAnything() {
  heard = performance.now();
}

/** Current simulation time [ms]. */
export function worldNow() {
  return Number.isNaN(offset) ? newest : offset + pace * performance.now();
}

/** Current simulation time [ms], for a component that shows it. */
export function shownTime() {
  void tenths.value;
  return worldNow();
}

/**
 * Age of a moment of simulation time [ms], in whole seconds.
 * @param {number} at [ms]
 */
export function ageOf(at) {
  void seconds.value;
  return worldNow() - at;
}

/**
 * Simulation time since a line was sent [s]: to be added to the ages in it.
 * @param {{t: number}} line
 */
export function sinceSent(line) {
  void tenths.value;
  return Math.max(0, (worldNow() - line.t) / 1000);
}

/** Age of the latest update from the simulation, in real time [s]. */
export function pageAge() {
  void tenths.value;
  return Math.max(0, (performance.now() - heard) / 1000);
}

/** True if what is shown is out of date: the connection is lost, or silent for too long. */
export const isStale = computed(
  () => connection.value !== 'connecting' && (connection.value !== 'open' || pageAge() > STALE_S),
);
effect(() => {
  document.documentElement.toggleAttribute('data-stale', isStale.value);
});

/** Simulation time of the newest message [ms]. */
export const newestTime = () => newest;
