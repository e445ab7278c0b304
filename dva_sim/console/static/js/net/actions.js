/** Requests from the person to the simulation, with their replies. */
import { signal } from '../../vendor/preact.js';
import { forget } from '../drive/hold.js';
import { PATIENCE_MS } from '../declared.js';
import { notice } from '../store.js';
import { steer } from './wire.js';

const ENDS = ['stop', 'release'];

/** @typedef {keyof typeof PATIENCE_MS} Action request that may be sent */

/** @type {Map<string, (done: {ok: boolean, text: string}) => void>} */
const waiting = new Map();

/** Number of times the driving socket was lost; each time a driver has to start again. */
export const driveLost = signal(0);

/** Random unique ID. */
export function newId() {
  const bytes = crypto.getRandomValues(new Uint8Array(12));
  return Array.from(bytes, (byte) => byte.toString(16).padStart(2, '0')).join('');
}

/**
 * Send a request; show a refusal to the person.
 * @param {Action} what
 * @param {object} [more]
 */
export async function act(what, more = {}) {
  return showRefusal(await ask(what, more));
}

/**
 * Send a request that the page makes by itself: a refusal is not shown.
 * @param {Action} what
 * @param {object} [more]
 * @param {string} [id] by which the simulation recognizes a repeated request
 * @returns {Promise<import('../types.js').Answer>} without an ID if no reply arrived
 */
export async function ask(what, more = {}, id = newId()) {
  if (ENDS.includes(what)) forget();
  if (!steer({ id, do: what, ...more })) {
    return { ok: false, text: 'Not connected to the simulation. Nothing was sent.' };
  }
  const answer = new Promise((resolve) => waiting.set(id, resolve));
  const patience = PATIENCE_MS[what];
  const timer = window.setTimeout(
    () => settle(id, { ok: false, text: `No answer to “${what}” within ${patience / 1000} s.` }),
    patience,
  );
  const done = await answer;
  window.clearTimeout(timer);
  return /** @type {import('../types.js').Answer} */ (done);
}

/** @param {import('../types.js').Answer} done */
export function showRefusal(done) {
  notice.value = done.ok ? '' : done.text;
  return done;
}

/**
 * Resolve a pending request with its reply.
 * @param {string} id
 * @param {import('../types.js').Answer} done
 */
export function settle(id, done) {
  waiting.get(id)?.(done);
  waiting.delete(id);
}

/** @param {boolean} unexpected @param {string} text for pending requests */
export function socketLost(unexpected, text) {
  for (const id of [...waiting.keys()]) {
    settle(id, { ok: false, text });
  }
  if (unexpected) driveLost.value += 1;
}
