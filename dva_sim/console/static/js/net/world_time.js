/**
 * The world's clock, as it runs on between two messages.
 *
 * The message that took the shortest way tells best: later ones pull the estimate back only slowly,
 * so that a late one does not make a picture look younger than it is.
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
 * Note the time that a message bears.
 * @param {number} t
 */
export function hear(t) {
  const now = performance.now();
  heard = now;
  newest = t;
  const latest = t - pace * now;
  offset = Number.isNaN(offset) || latest > offset ? latest : offset + PULL * (latest - offset);
}

/** A message without a time of the world. */
export function hearAnything() {
  heard = performance.now();
}

/** What the world's clock shows now [ms]. */
export function worldNow() {
  return Number.isNaN(offset) ? newest : offset + pace * performance.now();
}

/** Age of the latest update from the simulation [s]. */
export function pageAge() {
  return Math.max(0, (performance.now() - heard) / 1000);
}
