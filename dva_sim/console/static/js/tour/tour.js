/**
 * One minute that lets one feel it: the same short drive under two patterns, at the same delay, and
 * in the end the person's own two times.
 */
import { html, signal, useEffect } from '../../vendor/preact.js';
import { maySteer, modeOf, robots, rowOf, scene, seat, tracks } from '../store.js';
import { act } from '../net/actions.js';
import { worldNow } from '../net/world_time.js';
import { chooseRobots } from '../shell/route.js';
import { Icon } from '../ui/icon.js';
import { useEvery } from '../ui/every.js';

const DELAY_S = 0.5;
const PATTERNS = ['req-rep', 'latest-wins'];
const LOOK_MS = 100;
const MOVING_MPS = 0.02;
const WORDS = ['Set up', 'Drive the first robot', 'Drive the second robot', 'Your numbers'];

/** @typedef {{step: number, began: (number | null)[], took: (number | null)[]}} Progress */

/** Where the person is in the tour; null while there is none. */
export const progress = signal(/** @type {Progress | null} */ (null));

/** The marked goal of this part of the tour, if any. @returns {import('../types.js').Goal[]} */
export function tourGoals() {
  const leg = (progress.peek()?.step ?? 0) - 1;
  const goal = plan()?.goals_m[leg];
  if (!goal) return [];
  return [{ x: goal[0], y: goal[1], radius: plan()?.radius_m ?? 1, name: `Goal ${leg + 1}` }];
}

/** @returns {import('../types.js').TourPlan | null} */
function plan() {
  const known = scene.value?.tour;
  if (known) return known;
  return null;
}

/** The robot of a leg. @param {number} leg */
const robotOf = (leg) => robots.value.find((robot) => robot.i === plan()?.robots[leg]);

/** Begin: the delay, both patterns, the first robot. */
export async function takeTour() {
  progress.value = { step: 0, began: [null, null], took: [null, null] };
  await act('pace', { factor: 1, paused: false });
  await act('link', { delay_s: DELAY_S, jitter_s: 0, loss: 0 });
  for (const leg of [0, 1]) {
    const robot = robotOf(leg);
    if (robot) await act('pattern', { robot: robot.i, name: PATTERNS[leg] });
  }
  await go(1);
}

/** @param {number} step */
async function go(step) {
  if (!progress.value) return;
  if (seat.peek()?.drives.length) await act('release');
  progress.value = { ...progress.value, step };
  const robot = robotOf(step - 1);
  if (robot) chooseRobots([robot.label]);
}

/** The tour's button, where there is a plan for one. */
export function TourButton() {
  if (!plan() || progress.value) return null;
  return html`<button type="button" class="tour-button" disabled=${!maySteer.value} onClick=${takeTour}>
    <${Icon} name="flag" />Take the tour</button>`;
}

/** The panel that leads through it. */
export function Tour() {
  const now = progress.value;
  if (!plan() || !now) return null;
  return html`<aside class="tour" aria-label="Tour">
    <button type="button" class="close" aria-label="End the tour" onClick=${() => (progress.value = null)}>
      <${Icon} name="x" /></button>
    <p class="steps">${WORDS.map(
      (word, n) => html`<span class=${n === now.step ? 'now' : n < now.step ? 'past' : ''}>${word}</span>`,
    )}</p>
    ${now.step === 0 && html`<p>Setting the link to 500 ms one way …</p>`}
    ${(now.step === 1 || now.step === 2) && html`<${Leg} key=${now.step} leg=${now.step - 1} />`}
    ${now.step === 3 && html`<${Numbers} />`}
  </aside>`;
}

/** @param {{leg: number}} props */
function Leg({ leg }) {
  useEvery(LOOK_MS);
  const robot = robotOf(leg);
  const now = /** @type {Progress} */ (progress.value);
  useEffect(() => {
    const timer = window.setInterval(() => watchLeg(leg), LOOK_MS);
    return () => window.clearInterval(timer);
  }, [leg]);
  if (!robot) return null;
  const began = now.began[leg];
  const took = now.took[leg];
  const time = took ?? (began === null ? 0 : worldNow() - began);
  const title = titleOf(leg);
  return html`<h2>${robot.label} under ${title}</h2>
    <ol class="todo">
      <li class=${holds(robot.i) ? 'past' : ''}>Take control of ${robot.label}.</li>
      <li class=${modeOf(robot.i) === 'Teleoperation' || took !== null ? 'past' : ''}>Start.</li>
      <li class=${took === null ? '' : 'past'}>Hold <kbd>↑</kbd> and steer into the ring “Goal ${leg + 1}” on the map. The picture is half a second old; so is what the robot hears.</li>
    </ol>
    <p class="big">${(time / 1000).toFixed(1)} s <span class="soft">${began === null ? 'counts from the first move' : ''}</span></p>
    ${took !== null && html`<button type="button" class="go wide" onClick=${() => go(leg + 2)}>
      ${leg ? 'Show my numbers' : 'Next: the same under the other pattern'}</button>`}`;
}

/** @param {number} i */
const holds = (i) => Boolean(seat.value?.drives.some((drive) => drive.i === i));

/** @param {number} leg */
function titleOf(leg) {
  const name = rowOf(robotOf(leg)?.i ?? -1)?.pattern ?? PATTERNS[leg];
  return scene.value?.patterns.find((pattern) => pattern.name === name)?.title ?? name;
}

/**
 * From the first move to the ring.
 * @param {number} leg
 */
function watchLeg(leg) {
  const now = progress.value;
  const tour = plan();
  const robot = robotOf(leg);
  const place = robot && tracks.last(robot.i);
  if (!now || !tour || !robot || !place || now.took[leg] !== null) return;
  if (now.began[leg] === null) {
    if (holds(robot.i) && place.speed > MOVING_MPS) progress.value = noted(now, 'began', leg, worldNow());
    return;
  }
  const [x, y] = tour.goals_m[leg];
  if (Math.hypot(place.x - x, place.y - y) > tour.radius_m) return;
  progress.value = noted(now, 'took', leg, worldNow() - /** @type {number} */ (now.began[leg]));
  act('stop');
}

/**
 * @param {Progress} now
 * @param {'began' | 'took'} what
 * @param {number} leg
 * @param {number} value
 */
const noted = (now, what, leg, value) => ({
  ...now,
  [what]: now[what].map((old, n) => (n === leg ? value : old)),
});

function Numbers() {
  const took = /** @type {number[]} */ (progress.value?.took);
  const longest = Math.max(...took);
  const [first, second] = took.map((ms) => ms / 1000);
  const less = second < first ? 'less' : 'more';
  return html`<h2>Your drive times at 500 ms</h2>
    ${[0, 1].map(
      (leg) => html`<div class="bar-row"><span>${titleOf(leg)}</span>
        <span class="track"><span class=${`fill pattern-${rowOf(robotOf(leg)?.i ?? -1)?.pattern}`} style=${{ width: `${(100 * took[leg]) / longest}%` }}></span></span>
        <b>${(took[leg] / 1000).toFixed(1)} s</b></div>`,
    )}
    <p>Under ${titleOf(1)} you took ${Math.abs(first - second).toFixed(1)} s ${less}. One drive each says
      little: practice counts, too. A study repeats it with many persons and shares the chances.</p>
    <button type="button" class="wide" onClick=${takeTour}>Once more</button>`;
}
