/**
 * The motion sensor: the acceleration with gravity, in the axes of the device, as the browser has
 * it.
 *
 * Where `devicemotion` is missing, the angles of `deviceorientation` are turned into what gravity
 * alone would be (W3C Device Orientation: turns about z, then x, then y). The first event of a
 * phone without a sensor holds nothing but nulls; a phone that wants to be asked first sends none
 * at all until it has been, from a tap.
 */
import { signal } from '../../vendor/preact.js';

const G = 9.80665; // [m/s^2]
const RADIANS = Math.PI / 180;
const WAIT_MS = 1000;

/** @typedef {{at: number, xyz: number[]}} Sample time [ms] and acceleration [m/s^2] */

/** 'looking', 'live', 'tap' (it has to be asked for), 'denied', 'insecure', 'none'. */
export const state = signal(window.isSecureContext ? 'looking' : 'insecure');
/** The newest sample, for what is shown; it changes ten times a second. */
export const shown = signal(/** @type {Sample | null} */ (null));

const SHOWN_MS = 100;
const Motion = /** @type {any} */ (window.DeviceMotionEvent);
const Orientation = /** @type {any} */ (window.DeviceOrientationEvent);
/** Whether gravity's sign is the other one: so it is on iPhones and iPads. */
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

/** How long the sensor has been silent [ms], as counted by `countSilence`. */
export const silentFor = () => silent;

/**
 * Look again, every so many ms. A page that stood still in between could hear nothing, so a late
 * look counts as two of them: events that wait are delivered before the next one.
 * @param {number} every [ms]
 */
export function countSilence(every) {
  const now = performance.now();
  silent += Math.min(now - looked, 2 * every);
  looked = now;
}

/** @param {(sample: Sample) => void} hear @returns {() => void} how to end that */
export function onSample(hear) {
  hearers.add(hear);
  return () => hearers.delete(hear);
}

/**
 * How the phone is held: the mean of the last quarter of a second; null if it says nothing. Angles
 * are told only when they change: the newest ones hold.
 */
export function pose() {
  const now = performance.now();
  const some = recent.filter((sample, n) => now - sample.at < 250 || (!motion && n === recent.length - 1));
  if (!some.length) return null;
  return [0, 1, 2].map((n) => some.reduce((sum, { xyz }) => sum + xyz[n], 0) / some.length);
}

/** Listen, from now on. */
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

/** After a while without a value: what may be the reason. */
function judge() {
  if (state.peek() !== 'looking') return;
  state.value = !answered && Motion?.requestPermission ? 'tap' : 'none';
}

/** Ask the phone, which has to be from a tap, and wait a moment for what it then says. */
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
 * What gravity alone would be measured as, with the sign of this phone.
 * @param {number} beta about x [degrees]
 * @param {number} gamma about y [degrees]
 */
export function gravity(beta, gamma) {
  const [b, c] = [beta * RADIANS, gamma * RADIANS];
  const size = isIos ? -G : G;
  return [-Math.cos(b) * Math.sin(c), Math.sin(b), Math.cos(b) * Math.cos(c)].map((v) => size * v);
}

/** Each state in words, with the way out. */
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
