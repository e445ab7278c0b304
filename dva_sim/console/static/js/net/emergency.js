/** The emergency stop: on each path there is, again and again, until it is confirmed. */
import { signal } from '../../vendor/preact.js';
import { forget } from '../drive/hold.js';
import { notice, you } from '../store.js';
import { ask, newId } from './actions.js';

const AGAIN_MS = 1000; // from one attempt to the next
const REQUEST_MS = 10000; // after which a request is given up, so that none piles up

/** Why a stop is not confirmed yet; empty if none is open. */
export const unconfirmed = signal('');

/** @typedef {'all' | number[]} Robots */

/**
 * Stops that are not confirmed yet, by the robots they are for.
 * @type {Map<string, {again: () => void}>}
 */
const open = new Map();

/** Stop all robots. What is held then drives no robot at the next start. */
export const emergencyStop = () => stopRobots('all');

/** The person has seen that a stop is not confirmed, and ends the attempts. */
export function giveUp() {
  const all = [...open.values()];
  open.clear();
  unconfirmed.value = '';
  for (const each of all) each.again();
}

/**
 * Stop robots at once. The socket for driving is open already, a request needs nothing of it: the
 * first that brings a confirmation counts.
 * @param {Robots} which
 */
export async function stopRobots(which) {
  forget();
  const key = JSON.stringify(which);
  const running = open.get(key);
  if (running) {
    running.again();
    return;
  }
  const stop = { again: () => {} };
  open.set(key, stop);
  let id = newId();
  for (let attempt = 1; open.get(key) === stop; attempt += 1) {
    const pause = new Promise((go) => {
      stop.again = () => go(undefined);
      window.setTimeout(go, AGAIN_MS);
    });
    const { confirmed, refused } = await attemptStop(id, which, pause);
    if (open.get(key) !== stop) return;
    if (confirmed) {
      open.delete(key);
      if (open.size === 0) unconfirmed.value = '';
      notice.value = '';
      return;
    }
    if (refused) id = newId(); // the world has done with the first
    const why = refused || 'no answer';
    unconfirmed.value = `Emergency stop not confirmed: ${why}. Attempt ${attempt + 1} …`;
    await pause;
  }
}

/**
 * Ask on both paths at once.
 * @param {string} id
 * @param {Robots} which
 * @param {Promise<unknown>} pause how long an answer is waited for before the next attempt
 * @returns {Promise<{confirmed: boolean, refused: string}>}
 */
async function attemptStop(id, which, pause) {
  let refused = '';
  const paths = [overSocket(id, which), overRequest(id, which)].map(async (path) => {
    const done = await path;
    if (!done.ok) {
      if (done.isAnswer) refused = done.text;
      throw new Error(done.text);
    }
    return true;
  });
  const confirmed = await Promise.race([
    Promise.any(paths).catch(() => false),
    pause.then(() => false),
  ]);
  return { confirmed, refused };
}

/** @typedef {{ok: boolean, text: string, isAnswer: boolean}} Outcome */

/** @param {string} id @param {Robots} which @returns {Promise<Outcome>} */
async function overSocket(id, which) {
  const done = await ask('emergency', { robots: which }, id);
  return { ok: done.ok, text: done.text, isAnswer: Boolean(done.id) };
}

/** @param {string} id @param {Robots} which @returns {Promise<Outcome>} */
async function overRequest(id, which) {
  const body = JSON.stringify({ id, robots: which, key: you.peek()?.key });
  const headers = { 'Content-Type': 'application/json' };
  const about = { method: 'POST', headers, body, signal: AbortSignal.timeout(REQUEST_MS) };
  try {
    const answer = await fetch('/api/emergency', about);
    const done = await answer.json().catch(() => ({ ok: false, text: '' }));
    const text = done.text || `the server answered ${answer.status}`;
    return { ok: Boolean(answer.ok && done.ok), text, isAnswer: true };
  } catch {
    return { ok: false, text: 'the console cannot be reached', isAnswer: false };
  }
}
