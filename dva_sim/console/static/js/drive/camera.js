/** A robot's picture with its true age; an outdated picture is marked. */
import { html, useEffect, useRef, useState } from '../../vendor/preact.js';
import { pictures, rowOf, scene } from '../store.js';
import { isStale, pageAge } from '../net/world_time.js';
import { secondsText } from '../ui/words.js';
import { drawsNoMore, drew, pictureAge, sinceArrived } from './drawn.js';
import { play } from './mjpeg.js';

const OLD_PERIODS = 2;
const HATCHED_S = 2;

/** @param {{robot: import('../lines.js').Thing}} props */
export function CameraPicture({ robot }) {
  const canvas = useRef(/** @type {HTMLCanvasElement | null} */ (null));
  const [trouble, tell] = useState('');
  const seen = usePageSeen();
  useEffect(() => {
    if (!seen) return undefined;
    const stop = new AbortController();
    const url = `/camera/${encodeURIComponent(robot.label)}.mjpg`;
    play(url, (frame) => draw(canvas.current, robot.i, frame), tell, stop.signal);
    return () => {
      stop.abort();
      drawsNoMore(robot.i);
    };
  }, [robot.label, seen]);
  return html`<figure class="camera">
    <canvas ref=${canvas} width="320" height="240" role="img"
      aria-label=${`What ${robot.label} sees`}></canvas>
    <${Age} robot=${robot} trouble=${trouble} />
  </figure>`;
}

/** @param {{robot: import('../lines.js').Thing, trouble: string}} props */
function Age({ robot, trouble }) {
  const isElsewhere = rowOf(robot.i)?.camera !== undefined;
  const { age, text } = isElsewhere ? arrivalOf(robot) : ageOf(robot);
  const known = Number.isFinite(age);
  const period = 1 / (robot.camera?.rate_hz || 5);
  const limit = Math.max(HATCHED_S, scene.value?.stale_s ?? 0);
  const look = !known || age > limit || isStale.value ? 'hatched' : age > OLD_PERIODS * period ? 'old' : 'fresh';
  const silence = isStale.value ? `, no data for ${secondsTo(pageAge())}` : '';
  const shown = known ? text : (isElsewhere ? '' : pictures.value) || trouble || 'waiting for the first picture';
  return html`<div class=${`veil ${look}`}></div>
    <figcaption><span class=${`picture-age ${look}`}>${shown}${silence}</span></figcaption>`;
}

/** Age of a picture whose time is known. @param {import('../lines.js').Thing} robot */
function ageOf(robot) {
  const age = pictureAge(robot.i) / 1000;
  return { age, text: `${secondsTo(age)} old` };
}

/** Time since the arrival of a picture that has no known age. @param {import('../lines.js').Thing} robot */
function arrivalOf(robot) {
  const age = sinceArrived(robot.i) / 1000;
  return { age, text: `came ${secondsTo(age)} ago, age unknown` };
}

/** @param {number} age [s] */
const secondsTo = (age) => (age < 10 ? `${age.toFixed(2)} s` : secondsText(age));

/**
 * @param {HTMLCanvasElement | null} canvas
 * @param {number} robot
 * @param {import('./mjpeg.js').Frame} frame
 */
function draw(canvas, robot, frame) {
  if (!canvas) return;
  if (canvas.width !== frame.bitmap.width || canvas.height !== frame.bitmap.height) {
    canvas.width = frame.bitmap.width;
    canvas.height = frame.bitmap.height;
  }
  canvas.getContext('2d')?.drawImage(frame.bitmap, 0, 0);
  canvas.dataset.frame = String(frame.number);
  frame.bitmap.close();
  drew(robot, frame.capturedMs);
}

/** True while the page is visible; a hidden page reads no stream. */
function usePageSeen() {
  const [seen, see] = useState(!document.hidden);
  useEffect(() => {
    const change = () => see(!document.hidden);
    document.addEventListener('visibilitychange', change);
    return () => document.removeEventListener('visibilitychange', change);
  }, []);
  return seen;
}
