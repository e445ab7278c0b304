/** Sends raw sensor samples to the simulation in batches, with the phone's own timestamps. */
import { seenPictures } from '../drive/drawn.js';
import { backlog, steer } from '../net/wire.js';
import { choices } from './choices.js';
import { thumb, tilts } from './drive.js';
import { screen } from './screens.js';
import { listen, onSample } from './sensor.js';

const MIN_MS = 12; // between two batches: of 60 samples a second none waits for another
const MOST = 64; // samples in one
const MAX_BACKLOG = 4096; // [B] beyond it the connection does not keep up: the oldest are lost
const NEEDED_ON = ['calibration', 'teleoperation'];

/** @type {import('./sensor.js').Sample[]} */
let waiting = [];
let count = 0; // of the first that waits
let sent = -Infinity;
let timer = 0;

/** Start sampling. */
export function keepSampling() {
  listen();
  onSample((sample) => {
    if (!isWanted()) return drop();
    waiting.push(sample);
    if (waiting.length > MOST) lose();
    sendSoon();
  });
}

/** Send now, or once the minimum interval has passed; a periodic timer would delay samples. */
function sendSoon() {
  const wait = MIN_MS - (performance.now() - sent);
  if (wait <= 0) send();
  else if (!timer) timer = window.setTimeout(send, wait);
}

/** True if samples are needed: the phone steers by tilting, and the screen uses them. */
function isWanted() {
  return tilts.peek() && NEEDED_ON.includes(screen.peek());
}

/** Discard samples that are not needed; they do not count as lost. */
function drop() {
  waiting = [];
}

function lose() {
  waiting.shift();
  count += 1;
}

function send() {
  window.clearTimeout(timer);
  timer = 0;
  if (!waiting.length || backlog() > MAX_BACKLOG) return;
  const batch = waiting;
  const message = {
    do: 'samples',
    n: count,
    at: batch.map((sample) => Number(sample.at.toFixed(3))),
    xyz: batch.map((sample) => sample.xyz.map((value) => Number(value.toFixed(4)))),
    hand: !choices.peek().hold || thumb.peek(),
    orientation: orientation(),
    seen: seenPictures(),
  };
  if (!steer(message)) return;
  sent = performance.now();
  count += batch.length;
  waiting = [];
}

/** Rotation of the screen: 0, 90, 180 or 270 degrees. */
export function orientation() {
  const turned = window.screen?.orientation?.angle ?? /** @type {any} */ (window).orientation ?? 0;
  return (((Math.round(turned / 90) * 90) % 360) + 360) % 360;
}
