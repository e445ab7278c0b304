/** Round trip to the server: the best of the last pings, and the error of its clock. */
import { signal } from '../../vendor/preact.js';

const KEPT_MS = 30000;
const FIRST = 8;

/** @type {{at: number, took: number, offset: number}[]} */
let answers = [];
let asked = 0;

/** Round trip between this page and the server [ms], and the error of its clock [ms]. */
export const roundTrip = signal({ ms: NaN, offset: 0, error: NaN });

/**
 * Ping the server periodically.
 * @param {(message: object) => void} send
 * @returns {() => void} stops it
 */
export function keepAsking(send) {
  let timer = 0;
  const ask = () => {
    send({ do: 'ping', at: performance.now() });
    asked += 1;
    timer = window.setTimeout(ask, asked < FIRST ? 120 : 1000);
  };
  ask();
  return () => window.clearTimeout(timer);
}

/** @param {{at: number, now: number}} pong */
export function heardPong(pong) {
  const now = performance.now();
  const took = now - pong.at;
  const here = performance.timeOrigin + pong.at + took / 2;
  answers = answers.filter((answer) => now - answer.at < KEPT_MS);
  answers.push({ at: now, took, offset: pong.now - here });
  const best = answers.reduce((a, b) => (b.took < a.took ? b : a));
  roundTrip.value = { ms: best.took, offset: best.offset, error: best.took / 2 };
}
