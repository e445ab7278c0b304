/**
 * Simulation clock, extrapolated between messages.
 *
 * The message with the shortest delay gives the best estimate: others pull the estimate back only
 * slowly, so that a late one does not make a picture look younger than it is.
 */
import { effect } from '../../vendor/preact.js';
import { clock } from '../store.js';

const PULL = 0.05;
let offset = NaN;
let pace = 1;
let jumped = 0;
let heard = -Infinity;
let newest = 0;

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

/** Age of the latest update from the simulation [s]. */
export function pageAge() {
  return Math.max(0, (performance.now() - heard) / 1000);
}
