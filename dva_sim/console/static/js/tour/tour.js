/**
 * A one-minute tour that makes latency tangible: the same short drive under two patterns, at the same
 * delay, and at the end the person's own two times.
 */
import { html, useEffect } from '../../vendor/preact.js';
import { isModelled, maySteer, robots, rowOf } from '../store.js';
import { worldNow } from '../net/world_time.js';
import { Icon } from '../ui/icon.js';
import { useEvery } from '../ui/every.js';
import { drives, go, holds, isAtItsStart, progress, robotOf, takeTour, titleOf, watchLeg } from './progress.js';

const LOOK_MS = 100;
const WORDS = ['Set up', 'Drive the first robot', 'Drive the second robot', 'Your numbers'];
const HALF_ROUND = 2.5; // [rad]
const AHEAD = 0.2; // [rad]

/** Button that starts the tour; shown if there are at least two robots. */
export function TourButton() {
  if (robots.value.length < 2 || progress.value || !isModelled.value) return null;
  return html`<button type="button" class="tour-button" disabled=${!maySteer.value} onClick=${takeTour}>
    <${Icon} name="flag" />Take the tour</button>`;
}

/** Panel that guides through the tour. */
export function Tour() {
  const now = progress.value;
  if (!now) return null;
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
  useEffect(() => {
    const timer = window.setInterval(() => watchLeg(leg), LOOK_MS);
    return () => window.clearInterval(timer);
  }, [leg]);
  const robot = robotOf(leg);
  const now = progress.value;
  if (!robot || !now?.plan) return null;
  const began = now.began[leg];
  const took = now.took[leg];
  const time = took ?? (began === null ? 0 : worldNow() - began);
  const goal = `“Goal ${leg + 1}”`;
  return html`<div class="leg"><h2>${robot.label} under ${titleOf(leg)}</h2>
    <ol class="todo">
      <li class=${holds(robot.i) ? 'past' : ''}>Take control of ${robot.label}.</li>
      <li class=${drives(robot.i) || took !== null ? 'past' : ''}>Start.</li>
      <li class=${took === null ? '' : 'past'}>${turnText(now.plan.side_rad, goal)} hold <kbd>↑</kbd> and stop inside it. The picture is half a second old, and your commands take another half
        second.</li>
    </ol>
    <div><p class="big">${(time / 1000).toFixed(1)} s</p><p class="soft">${hint(leg)}</p></div>
    ${took === null
      ? html`<button type="button" key="again" class="wide" onClick=${takeTour}>Begin again</button>`
      : html`<button type="button" key="go" class="go wide" onClick=${() => go(leg + 2)}>
          ${leg ? 'Show my numbers' : 'Next: the same with the other pattern'}</button>`}</div>`;
}

/**
 * Instruction to turn before driving straight ahead.
 * @param {number} side of the goal from the robot's heading, to the left positive [rad]
 * @param {string} goal
 */
function turnText(side, goal) {
  if (Math.abs(side) < AHEAD) return html`The ring ${goal} on the map is straight ahead:`;
  const [key, where] = side > 0 ? ['←', 'to the left'] : ['→', 'to the right'];
  const far = Math.abs(side) > HALF_ROUND ? 'around' : where;
  return html`Hold <kbd>${key}</kbd> to turn ${far} until the ring ${goal} on the map is ahead, then`;
}

/** @param {number} leg */
function hint(leg) {
  const now = progress.value;
  if (now?.took[leg] !== null) return '';
  if (!isAtItsStart(leg)) return 'the robot has been moved: begin again';
  if (now.began[leg] === null) return 'the clock starts with the first move';
  return drives(robotOf(leg)?.i) ? '' : 'the drive has ended but the clock is running: press Start, or begin again';
}

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
    <p>Under ${titleOf(1)} you took ${Math.abs(first - second).toFixed(1)} s ${less}. One drive each proves little, and practice counts too. A study repeats this with many people
      in random order.</p>
    <button type="button" class="wide" onClick=${takeTour}>Do it again</button>`;
}
