/** What the person asks of the world, with the answer to each. */
import { signal } from '../../vendor/preact.js';
import { forget } from '../drive/hold.js';
import { notice, you } from '../store.js';
import { steer } from './wire.js';

const PATIENCE_MS = 8000;
const LONG_MS = 65000; // for what the DVA answers, or does not after all attempts
const BY_THE_DVA = ['phone_register', 'phone_devices', 'phone_permission', 'fake_add'];
const ENDS = ['stop', 'release'];

/** @type {Map<string, (done: {ok: boolean, text: string}) => void>} */
const waiting = new Map();

/** Counts how often the socket for driving was lost: who drives has to begin anew. */
export const driveLost = signal(0);

/** An id that nobody else makes. */
function newId() {
  const bytes = crypto.getRandomValues(new Uint8Array(12));
  return Array.from(bytes, (byte) => byte.toString(16).padStart(2, '0')).join('');
}

/**
 * Ask for something; what is refused is told to the person.
 * @param {string} what
 * @param {object} [more]
 * @returns {Promise<import('../types.js').Done>}
 */
export async function act(what, more = {}) {
  if (ENDS.includes(what)) forget();
  const id = newId();
  if (!steer({ id, do: what, ...more })) {
    return told({ ok: false, text: 'There is no connection to the world; nothing was sent.' });
  }
  const answer = new Promise((resolve) => waiting.set(id, resolve));
  const patience = BY_THE_DVA.includes(what) ? LONG_MS : PATIENCE_MS;
  const timer = window.setTimeout(
    () => settle({ id, ok: false, text: `No answer to “${what}” within ${patience / 1000} s.` }),
    patience,
  );
  const done = await answer;
  window.clearTimeout(timer);
  return told(/** @type {import('../types.js').Done} */ (done));
}

/** @param {import('../types.js').Done} done */
function told(done) {
  notice.value = done.ok ? '' : done.text;
  return done;
}

/** @param {import('../types.js').Done} done */
export function settle(done) {
  waiting.get(done.id ?? '')?.(done);
  waiting.delete(done.id ?? '');
}

/** @param {boolean} unexpected */
export function socketLost(unexpected) {
  for (const id of [...waiting.keys()]) {
    settle({ id, ok: false, text: 'The connection was lost before the answer came.' });
  }
  if (unexpected) driveLost.value += 1;
}

/** Stop all robots. What is held then drives no robot at the next start. */
export const emergencyStop = () => stopRobots('all');

/**
 * Stop robots at once, on a way of its own.
 * @param {'all' | number[]} which
 */
export async function stopRobots(which) {
  forget();
  const body = JSON.stringify({ id: newId(), robots: which, client: you.peek()?.client });
  const headers = { 'Content-Type': 'application/json' };
  try {
    const answer = await fetch('/api/emergency', { method: 'POST', headers, body });
    const done = await answer.json().catch(() => ({ ok: false, text: '' }));
    const text = done.text || `Emergency stop: the server answered ${answer.status}.`;
    return told({ ok: Boolean(answer.ok && done.ok), text });
  } catch {
    return told({ ok: false, text: 'Emergency stop did not reach the server.' });
  }
}
