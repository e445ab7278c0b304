/**
 * The motion sensor: acceleration including gravity, in the axes of the device, as reported by the
 * browser.
 *
 * If `devicemotion` is missing, gravity alone is computed from the angles of `deviceorientation`
 * (W3C Device Orientation: turns about z, then x, then y). The first event of a phone without a
 * sensor contains only nulls; a phone that requires permission sends no events until it is
 * requested from a tap.
 */
import { signal } from '../../vendor/preact.js';

const G = 9.80665; // [m/s^2]
const RADIANS = Math.PI / 180;
const WAIT_MS = 1000;

/** @typedef {{at: number, xyz: number[]}} Sample time [ms] and acceleration [m/s^2] */

/** 'looking', 'live', 'tap' (permission has to be requested), 'denied', 'insecure', 'none'. */
export const state = signal(window.isSecureContext ? 'looking' : 'insecure');
/** Newest sample for display, updated ten times a second. */
export const shown = signal(/** @type {Sample | null} */ (null));

const SHOWN_MS = 100;
const Motion = /** @type {any} */ (window.DeviceMotionEvent);
const Orientation = /** @type {any} */ (window.DeviceOrientationEvent);
/** True on iPhones and iPads, where gravity has the opposite sign. */
export const isIos =
  /iP(hone|ad|od)/.test(navigator.userAgent) ||
  (navigator.userAgent.includes('Macintosh') && navigator.maxTouchPoints > 1);

/** @type {Set<(sample: Sample) => void>} */
const hearers = new Set();
/** @type {Sample[]} */
let recent = [];
let silent = 0;
let looked = 0;
let motion = false;
let answered = false;

/** Time without a sample [ms], as counted by `countSilence`. */
export const silentFor = () => silent;

/**
 * Count the time since the last call as silence. A frozen page receives no events, so a late call
 * counts as at most two periods: pending events are delivered before the next one.
 * @param {number} every period of the calls [ms]
 */
export function countSilence(every) {
  const now = performance.now();
  silent += Math.min(now - looked, 2 * every);
  looked = now;
}

/** @param {(sample: Sample) => void} hear @returns {() => void} stops it */
export function onSample(hear) {
  hearers.add(hear);
  return () => hearers.delete(hear);
}

/**
 * Pose of the phone: the mean acceleration of the last 250 ms; null without samples. Angles are
 * reported only on change, so their newest sample stays valid.
 */
export function pose() {
  const now = performance.now();
  const some = recent.filter((sample, n) => now - sample.at < 250 || (!motion && n === recent.length - 1));
  if (!some.length) return null;
  return [0, 1, 2].map((n) => some.reduce((sum, { xyz }) => sum + xyz[n], 0) / some.length);
}

/** Start listening. */
export function listen() {
  if (state.peek() === 'insecure') return;
  window.addEventListener('devicemotion', (event) => {
    const { x, y, z } = event.accelerationIncludingGravity ?? { x: null, y: null, z: null };
    answered = true;
    if (x === null || y === null || z === null) return;
    motion = true;
    take({ at: event.timeStamp, xyz: [x, y, z] });
  });
  window.addEventListener('deviceorientation', ({ timeStamp, beta, gamma }) => {
    answered = true;
    if (motion || beta === null || gamma === null) return;
    take({ at: timeStamp, xyz: gravity(beta, gamma) });
  });
  window.setTimeout(judge, WAIT_MS);
}

/** Determine the likely reason for receiving no value after a while. */
function judge() {
  if (state.peek() !== 'looking') return;
  state.value = !answered && Motion?.requestPermission ? 'tap' : 'none';
}

/** Request permission, which has to be done from a tap, and wait briefly for the first sample. */
export async function ask() {
  if (state.peek() !== 'tap' && state.peek() !== 'denied') return;
  try {
    const asked = [Motion, Orientation].map((kind) => kind?.requestPermission?.() ?? 'granted');
    const answers = await Promise.all(asked);
    state.value = answers.every((answer) => answer === 'granted') ? 'looking' : 'denied';
  } catch {
    return; // it was no tap: the next one asks again
  }
  if (state.peek() === 'looking') await firstSample();
  if (state.peek() === 'looking') state.value = 'none';
}

/** @returns {Promise<void>} */
function firstSample() {
  return new Promise((go) => {
    const end = onSample(() => {
      end();
      go();
    });
    window.setTimeout(go, WAIT_MS);
  });
}

/** @param {Sample} sample */
function take(sample) {
  const last = recent.at(-1)?.at ?? -Infinity;
  if (sample.at <= last || !sample.xyz.every(Number.isFinite)) return;
  silent = 0;
  recent = [...recent.slice(-63), sample];
  state.value = 'live';
  if (sample.at - (shown.peek()?.at ?? -Infinity) >= SHOWN_MS) shown.value = sample;
  for (const hear of hearers) hear(sample);
}

/**
 * Acceleration measured from gravity alone, with the sign used by this phone.
 * @param {number} beta about x [degrees]
 * @param {number} gamma about y [degrees]
 */
export function gravity(beta, gamma) {
  const [b, c] = [beta * RADIANS, gamma * RADIANS];
  const size = isIos ? -G : G;
  return [-Math.cos(b) * Math.sin(c), Math.sin(b), Math.cos(b) * Math.cos(c)].map((v) => size * v);
}

/** Description of each state, with the remedy. */
export const WORDS = /** @type {Record<string, string>} */ ({
  looking: 'Looking for the motion sensor …',
  live: 'The motion sensor works.',
  tap: 'This phone asks before it shares its motion sensor. Tap Calibrate or Start.',
  denied:
    'this page has no permission to read it. Allow motion and orientation for this page in the ' +
    'settings of the browser and load it again, or steer by the stick.',
  insecure:
    'browsers give it to pages over https alone. Open the address that begins with https, or steer ' +
    'by the stick.',
  none: 'none answers. Steer by the stick on the screen, by keys or by a gamepad.',
});
