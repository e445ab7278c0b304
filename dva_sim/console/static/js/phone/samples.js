/** Samples on their way to the world: as they are, in batches, with the phone's own times. */
import { seenPictures } from '../drive/drawn.js';
import { backlog, steer } from '../net/wire.js';
import { choices } from './choices.js';
import { thumb, tilts } from './drive.js';
import { screen } from './screens.js';
import { listen, onSample } from './sensor.js';

const LEAST_MS = 12; // between two batches: of 60 samples a second none waits for another
const MOST = 64; // samples in one
const MOST_BACKLOG = 4096; // [B] beyond it the connection does not keep up: the oldest are lost
const NEEDED_ON = ['calibration', 'teleoperation'];

/** @type {import('./sensor.js').Sample[]} */
let waiting = [];
let count = 0; // of the first that waits
let sent = -Infinity;
let timer = 0;

/** From now on. */
export function keepSampling() {
  listen();
  onSample((sample) => {
    if (!isWanted()) return drop();
    waiting.push(sample);
    if (waiting.length > MOST) lose();
    sendSoon();
  });
}

/** Now, or as soon as the last batch is old enough: a timer of its own would make samples wait. */
function sendSoon() {
  const wait = LEAST_MS - (performance.now() - sent);
  if (wait <= 0) send();
  else if (!timer) timer = window.setTimeout(send, wait);
}

/** Whether anybody would make something of them. */
function isWanted() {
  return tilts.peek() && NEEDED_ON.includes(screen.peek());
}

/** What nobody wants does not count as lost. */
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
  if (!waiting.length || backlog() > MOST_BACKLOG) return;
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

/** How far the screen is turned: 0, 90, 180 or 270 degrees. */
export function orientation() {
  const turned = window.screen?.orientation?.angle ?? /** @type {any} */ (window).orientation ?? 0;
  return (((Math.round(turned / 90) * 90) % 360) + 360) % 360;
}
