/**
 * Hold to drive: the robot moves only while something is held.
 *
 * Keys, pointer, sliders and gamepad each request a motion for as long as they are held; the newest
 * request applies. Any interruption (the window loses the focus, the page is hidden, the connection
 * breaks, the screen is turned) stops the robot at once, and an input held at that moment is ignored
 * until it is released: only a new gesture resumes driving. The same applies after the end of a
 * drive: an input that was never released does not move the robot at the next start.
 */
import { effect, signal } from '../../vendor/preact.js';
import { seat, you } from '../store.js';
import { steer } from '../net/wire.js';
import { seenPictures } from './drawn.js';

const EVERY_MS = 40;
const MIN_MS = 15;

/** @typedef {{speed: number, turn: number}} Wish shares of the limits; turn to the left positive */

/** Motion currently requested. */
export const wish = signal(/** @type {Wish} */ ({ speed: 0, turn: 0 }));
/** True while any input is held. */
export const held = signal(false);
/** True while a drive continues without a held input: a phone is steered by tilting it. */
export const engaged = signal(false);
/** Reason why driving was interrupted; empty once an input is held again. */
export const interrupted = signal('');

/** @type {Map<string, Wish>} */
const sources = new Map();
/** @type {Set<() => void>} */
const releases = new Set();
let what = 'input';
let count = 0;
let sent = 0;
let timer = 0;
let soon = 0;

/**
 * Request a motion from a source until it is released.
 * @param {string} source
 * @param {Wish} wanted
 */
export function hold(source, wanted) {
  sources.delete(source);
  sources.set(source, wanted);
  interrupted.value = '';
  changed();
}

/** @param {string} source */
export function letGo(source) {
  if (sources.delete(source)) changed();
}

/**
 * Call a function whenever all held inputs are discarded.
 * @param {() => void} release
 * @returns {() => void} stops it
 */
export function onRelease(release) {
  releases.add(release);
  return () => releases.delete(release);
}

/**
 * Stop at once, whatever is held, and show the reason.
 * @param {string} why
 */
export function interrupt(why) {
  const was = held.value || engaged.value;
  engaged.value = false;
  forget();
  if (!was) return;
  steer({ do: 'gone' });
  interrupted.value = why;
}

/** Discard all held inputs until they are released and held again. */
export function forget() {
  sources.clear();
  for (const release of releases) release();
  changed();
}

/**
 * Discard held inputs when a drive ends or fails to start, for whatever reason. Inputs held later
 * apply, also while the next drive is starting.
 * @returns {() => void} stops it
 */
function watchEnds() {
  let before = '';
  return effect(() => {
    if (!seat.value) return; // sent again in a moment: no end of a drive
    const now = seat.value.phase;
    const failed = before === 'starting' && now !== 'starting' && now !== 'driving';
    if (failed || (before === 'driving' && now !== 'driving')) forget();
    before = now;
  });
}

function changed() {
  const last = [...sources.values()].at(-1);
  const before = wish.value;
  const next = last ?? { speed: 0, turn: 0 };
  const same = before.speed === next.speed && before.turn === next.turn;
  if (!same) wish.value = next;
  if (same && held.value === Boolean(last)) return;
  held.value = Boolean(last);
  const left = MIN_MS - (performance.now() - sent);
  if (!held.value || left <= 0) send();
  else if (!soon) soon = window.setTimeout(send, left);
  keepSending();
}

function keepSending() {
  if (held.value && !timer) timer = window.setInterval(send, EVERY_MS);
  if (!held.value && timer) {
    window.clearInterval(timer);
    timer = 0;
  }
}

function send() {
  window.clearTimeout(soon);
  soon = 0;
  count += 1;
  sent = performance.now();
  const { speed, turn } = wish.value;
  steer({ do: what, n: count, speed, turn, held: held.value, seen: seenPictures() });
}

/**
 * Direct held inputs to a target other than the robots of the seat, until stopped.
 * @param {string} name of the input in messages to the simulation
 * @returns {() => void} stops it
 */
export function steerWith(name) {
  forget();
  what = name;
  return () => {
    forget();
    what = 'input';
  };
}

/** Report that the page is closing by a beacon, in case the socket can no longer send. */
function sayGone() {
  const body = JSON.stringify({ action: 'gone', key: you.peek()?.key });
  navigator.sendBeacon?.('/api/actions', new Blob([body], { type: 'application/json' }));
}

/** Start watching for interruptions. @returns {() => void} stops it */
export function watchInterruptions() {
  const blur = () => interrupt('The window lost focus.');
  const hide = () => document.hidden && interrupt('The page was hidden.');
  const leave = () => {
    if (held.value || engaged.value) sayGone();
    interrupt('The page was left.');
  };
  const turned = () => interrupt('The screen was rotated.');
  window.addEventListener('blur', blur);
  window.addEventListener('pagehide', leave);
  document.addEventListener('visibilitychange', hide);
  document.addEventListener('freeze', leave);
  window.screen?.orientation?.addEventListener?.('change', turned);
  window.addEventListener('orientationchange', turned); // where the screen tells nothing
  const endWatch = watchEnds();
  return () => {
    endWatch();
    window.removeEventListener('blur', blur);
    window.removeEventListener('pagehide', leave);
    document.removeEventListener('visibilitychange', hide);
    document.removeEventListener('freeze', leave);
    window.screen?.orientation?.removeEventListener?.('change', turned);
    window.removeEventListener('orientationchange', turned);
  };
}
