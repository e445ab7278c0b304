/** Emergency stop: sent on every available path, and repeated until it is confirmed. */
import { signal } from '../../vendor/preact.js';
import { forget } from '../drive/hold.js';
import { notice, robots, you } from '../store.js';
import { ask, newId } from './actions.js';

const AGAIN_MS = 1000; // from one attempt to the next
const REQUEST_MS = 60000; // after which a request is given up, so that none piles up
const KEPT = 'dva-sim-unconfirmed-stops';

/** Reason why a stop is not confirmed yet; empty if none is pending. */
export const unconfirmed = signal('');

/** @typedef {'all' | number[]} Robots */

/**
 * Stops that are not confirmed yet, by the robots they are for.
 * @type {Map<string, {again: () => void}>}
 */
const open = new Map();

/** Stop all robots. Inputs held at that moment do not drive a robot at the next start. */
export const emergencyStop = () => stopRobots('all');

/** Stop retrying, once the person has seen that a stop is not confirmed. */
export function giveUp() {
  const all = [...open.values()];
  open.clear();
  remember();
  unconfirmed.value = '';
  for (const each of all) each.again();
}

/**
 * Stop robots at once, over the driving socket, which is already open, and by an HTTP request, which
 * does not depend on it. The first confirmation counts.
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
  remember();
  unconfirmed.value ||= 'Emergency stop not confirmed yet …';
  let id = newId();
  /** @type {Promise<Outcome>[]} */
  let asked = [];
  for (let attempt = 1; open.get(key) === stop; attempt += 1) {
    const pause = new Promise((go) => {
      stop.again = () => go(undefined);
      window.setTimeout(go, AGAIN_MS);
    });
    asked.push(overSocket(id, which), overRequest(id, which));
    const done = await Promise.race([decided(asked), pause.then(() => null)]);
    if (open.get(key) !== stop) return;
    if (done?.ok) {
      confirmed(key);
      return;
    }
    if (done && singles(which).length > 1) {
      // Some robot has not confirmed: the others need not be stopped again and again for it.
      for (const one of singles(which)) stopRobots([one]);
      open.delete(key);
      remember();
      return;
    }
    if (done) {
      id = newId(); // the world has done with the first
      asked = [];
    }
    const why = done?.text || 'no answer';
    unconfirmed.value = `Emergency stop not confirmed: ${why}. Attempt ${attempt + 1} …`;
    await pause;
  }
}

/** @param {Robots} which */
const singles = (which) => (which === 'all' ? robots.peek().map((robot) => robot.i) : which);

/** @param {string} key */
function confirmed(key) {
  open.delete(key);
  remember();
  if (open.size === 0) unconfirmed.value = '';
  notice.value = '';
}

/**
 * Resolve with the first reply from the simulation to requests with the same ID.
 * @param {Promise<Outcome>[]} asked
 * @returns {Promise<Outcome>}
 */
function decided(asked) {
  return new Promise((settle) => {
    for (const each of asked) each.then((done) => done.isAnswer && settle(done));
  });
}

/** @typedef {{ok: boolean, text: string, isAnswer: boolean}} Outcome */

/** @param {string} id @param {Robots} which @returns {Promise<Outcome>} */
async function overSocket(id, which) {
  const done = await ask('emergency', { robots: which }, id);
  return { ok: done.ok, text: done.text, isAnswer: Boolean(done.id) && !done.late };
}

/** @param {string} id @param {Robots} which @returns {Promise<Outcome>} */
async function overRequest(id, which) {
  const body = JSON.stringify({ id, robots: which, key: you.peek()?.key });
  const headers = { 'Content-Type': 'application/json' };
  const end = new AbortController();
  window.setTimeout(() => end.abort(), REQUEST_MS);
  try {
    const about = { method: 'POST', headers, body, signal: end.signal };
    const answer = await fetch('/api/emergency', about);
    const done = await answer.json().catch(() => ({ ok: false, text: '' }));
    const text = done.text || `the server answered ${answer.status}`;
    return { ok: Boolean(answer.ok && done.ok), text, isAnswer: answer.status === 200 };
  } catch {
    return { ok: false, text: 'the console cannot be reached', isAnswer: false };
  }
}

/** Keep the open stops, so that the page resumes them when it is loaded again. */
function remember() {
  try {
    sessionStorage.setItem(KEPT, JSON.stringify([...open.keys()]));
  } catch {
    // Without storage a reload ends the attempts.
  }
}

/** Resume the stops that were not confirmed before the page was loaded again. */
export function resumeStops() {
  try {
    for (const key of JSON.parse(sessionStorage.getItem(KEPT) ?? '[]')) stopRobots(JSON.parse(key));
  } catch {
    // What is kept there is not ours.
  }
}
