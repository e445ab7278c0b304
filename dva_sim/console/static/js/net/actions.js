/** What the person asks of the world, with the answer to each. */
import { signal } from '../../vendor/preact.js';
import { forget } from '../drive/hold.js';
import { notice, you } from '../store.js';
import { steer } from './wire.js';

const PATIENCE_MS = 8000;
const LONG_MS = 65000; // for what a robot or the DVA answers, or does not after all attempts
const OVER_THE_LINK = [
  'take',
  'start',
  'stop',
  'confirm',
  'refute',
  'robot_register',
  'phone_register',
  'phone_devices',
  'phone_permission',
  'fake_add',
  'guard_say',
  'guard_report',
  ...['event_raise', 'event_acknowledge', 'event_assign', 'event_take_off', 'event_false_alarm'],
  ...['event_escalate', 'event_note', 'event_proposal', 'alarm_acknowledge', 'room_join'],
  ...['dispatch_mode', 'mission', 'take_over'],
];
const ENDS = ['stop', 'release'];
const STOP_ATTEMPTS = 3;
const STOP_AGAIN_MS = 3000; // without an answer to an emergency stop
const REFUSED_AGAIN_MS = 300; // where nobody listens

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
 */
export async function act(what, more = {}) {
  return told(await ask(what, more));
}

/**
 * Ask for something, as a page does by itself: nobody is told what was refused.
 * @param {string} what
 * @param {object} [more]
 * @returns {Promise<import('../types.js').Done>}
 */
export async function ask(what, more = {}) {
  if (ENDS.includes(what)) forget();
  const id = newId();
  if (!steer({ id, do: what, ...more })) {
    return { ok: false, text: 'There is no connection to the world; nothing was sent.' };
  }
  const answer = new Promise((resolve) => waiting.set(id, resolve));
  const patience = OVER_THE_LINK.includes(what) ? LONG_MS : PATIENCE_MS;
  const timer = window.setTimeout(
    () => settle({ id, ok: false, text: `No answer to “${what}” within ${patience / 1000} s.` }),
    patience,
  );
  const done = await answer;
  window.clearTimeout(timer);
  return /** @type {import('../types.js').Done} */ (done);
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
  /** @type {Promise<import('../types.js').Done>[]} */
  const asked = [];
  for (let attempt = 1; attempt <= STOP_ATTEMPTS; attempt += 1) {
    asked.push(askToStop(body)); // the same id: it is done once
    const any = Promise.any(asked).catch(() => later(REFUSED_AGAIN_MS));
    const done = await Promise.race([any, later(STOP_AGAIN_MS)]);
    if (done) return told(done);
    if (attempt < STOP_ATTEMPTS) notice.value = `Emergency stop: no answer to attempt ${attempt}, trying again …`;
  }
  return told({ ok: false, text: NOT_STOPPED });
}

const NOT_STOPPED =
  `link lost: the emergency stop did not reach the console in ${STOP_ATTEMPTS} attempts. ` +
  'The robot stops by itself when it hears no commands.';

/** @param {number} ms @returns {Promise<null>} */
const later = (ms) => new Promise((go) => window.setTimeout(() => go(null), ms));

/**
 * One request, on a connection that carries nothing else.
 * @param {string} body
 * @returns {Promise<import('../types.js').Done>} rejected if the console cannot be reached
 */
async function askToStop(body) {
  const headers = { 'Content-Type': 'application/json' };
  const answer = await fetch('/api/emergency', { method: 'POST', headers, body });
  const done = await answer.json().catch(() => ({ ok: false, text: '' }));
  const text = done.text || `Emergency stop: the server answered ${answer.status}.`;
  return { ok: Boolean(answer.ok && done.ok), text };
}
