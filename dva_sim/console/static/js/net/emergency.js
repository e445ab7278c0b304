/** Emergency stop: sent on every available path, and repeated until it is confirmed or refused. */
import { effect, signal } from '../../vendor/preact.js';
import { forget } from '../drive/hold.js';
import { notice, robots, rowOf, rows, you } from '../store.js';
import { ask, newId } from './actions.js';
import { worldNow } from './world_time.js';

const REFRESH_MS = 1000; // from one attempt to the next
const REQUEST_MS = 60000; // after which a request is given up, so that none piles up
const KEPT = 'dva-sim-unconfirmed-stops';
const REFUSED = 'refused'; // outcome of what asking again does not change
const MOVING = ['Mission', 'Teleoperation'];

/** Reason why a stop is not confirmed yet; empty if none is pending. */
export const unconfirmed = signal('');
/** Reason for which the newest stop was refused; empty if it was not. */
export const refused = signal('');
/**
 * Robots that have confirmed a stop of this page, with the simulation time of the confirmation [ms].
 * @type {import('../../vendor/preact.js').Signal<Map<number, number>>}
 */
export const stopped = signal(new Map());

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
  refused.value = '';
  unconfirmed.value ||= 'Emergency stop not confirmed yet …';
  let id = newId();
  /** @type {Promise<Outcome>[]} */
  let asked = [];
  for (let attempt = 1; open.get(key) === stop; attempt += 1) {
    const pause = new Promise((go) => {
      stop.again = () => go(undefined);
      window.setTimeout(go, REFRESH_MS);
    });
    asked.push(overSocket(id, which), overRequest(id, which));
    const done = await firstAnswer(asked, pause);
    if (open.get(key) !== stop) return;
    if (done?.ok || done?.isRefusal) {
      close(key);
      if (done.ok) confirm(which);
      else refused.value = done.text;
      return;
    }
    if (done && singles(which).length > 1) {
      // Some robot has not confirmed: the others need not be stopped again and again for it.
      for (const one of singles(which)) stopRobots([one]);
      close(key);
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
function close(key) {
  open.delete(key);
  remember();
  if (open.size === 0) unconfirmed.value = '';
}

/** @param {Robots} which */
function confirm(which) {
  const at = worldNow();
  stopped.value = new Map([...stopped.peek(), .../** @type {[number, number][]} */ (singles(which).map((i) => [i, at]))]);
  notice.value = '';
}

/** Forget confirmations of robots that have been ordered to move again since. */
effect(() => {
  const t = rows.value?.t ?? 0;
  const isOver = (/** @type {[number, number]} */ [i, at]) => t > at && (rowOf(i)?.by_hand || MOVING.includes(rowOf(i)?.mode ?? ''));
  const left = [...stopped.value].filter((entry) => !isOver(entry));
  if (left.length < stopped.value.size) stopped.value = new Map(left);
});

/**
 * Resolve with the first answer to requests with the same ID. A refusal counts if no path brings an
 * answer before all have ended or the pause is over; null if there is none either.
 * @param {Promise<Outcome>[]} asked
 * @param {Promise<unknown>} pause
 * @returns {Promise<Outcome | null>}
 */
function firstAnswer(asked, pause) {
  /** @type {Outcome | null} */
  let refusal = null;
  const answers = asked.map(async (each) => {
    const done = await each;
    if (done.isAnswer) return done;
    if (done.isRefusal) refusal = done;
    throw new Error(done.text);
  });
  return Promise.race([Promise.any(answers), pause.then(() => refusal)]).catch(() => refusal);
}

/**
 * Outcome of one path: an answer of the simulation, a refusal, or neither.
 * @typedef {{ok: boolean, text: string, isAnswer: boolean, isRefusal: boolean}} Outcome
 */

/** @param {string} id @param {Robots} which @returns {Promise<Outcome>} */
async function overSocket(id, which) {
  const done = await ask('emergency', { robots: which }, id);
  const isRefusal = done.outcome === REFUSED;
  return { ok: done.ok, text: done.text, isAnswer: Boolean(done.id) && !done.late && !isRefusal, isRefusal };
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
    const isRefusal = done.outcome === REFUSED || (answer.status >= 400 && answer.status < 500);
    return { ok: Boolean(answer.ok && done.ok), text, isAnswer: answer.status === 200 && !isRefusal, isRefusal };
  } catch {
    return { ok: false, text: 'the console cannot be reached', isAnswer: false, isRefusal: false };
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
