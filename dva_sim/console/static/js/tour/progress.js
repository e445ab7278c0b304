/** Progress in the tour: its goals, and the person's own times. */
import { signal } from '../../vendor/preact.js';
import { modeOf, robots, rowOf, scene, seat, tracks } from '../store.js';
import { act } from '../net/actions.js';
import { worldNow } from '../net/world_time.js';
import { chooseRobots } from '../shell/route.js';

export const DELAY_S = 0.5;
const PATTERNS = ['req-rep', 'latest-wins'];
const STILL_MPS = 0.02;
const MOVED_M = 0.5; // somebody has driven the second robot away meanwhile

/**
 * @typedef {{step: number, plan: import('../lines.js').TourPlan | null, began: (number | null)[],
 *   took: (number | null)[]}} Progress
 */

/** Current progress in the tour; null while no tour is running. */
export const progress = signal(/** @type {Progress | null} */ (null));

/** The marked goal of this part of the tour, if any. @returns {import('../types.js').Goal[]} */
export function tourGoals() {
  const { step = 0, plan = null } = progress.peek() ?? {};
  const goal = plan?.goals_m[step - 1];
  if (!plan || !goal) return [];
  return [{ x: goal[0], y: goal[1], radius: plan.radius_m, name: `Goal ${step}` }];
}

/** The robot of a leg. @param {number} leg */
export const robotOf = (leg) =>
  robots.value.find((robot) => robot.i === progress.value?.plan?.robots[leg]);

/** @param {number} leg */
export function titleOf(leg) {
  const name = rowOf(robotOf(leg)?.i ?? -1)?.pattern ?? PATTERNS[leg];
  return scene.value?.patterns.find((pattern) => pattern.name === name)?.title ?? name;
}

/** @param {number | undefined} i */
export const holds = (i) => Boolean(seat.value?.drives.some((drive) => drive.i === i));

/** @param {number | undefined} i */
export const drives = (i) => i !== undefined && holds(i) && modeOf(i) === 'Teleoperation';

/** Begin: the delay, both patterns, goals from where the robots stand now, the first robot. */
export async function takeTour() {
  progress.value = { step: 0, plan: null, began: [null, null], took: [null, null] };
  if (seat.peek()?.drives.length) await act('release');
  const answer = await act('tour');
  if (!answer.tour || !progress.value) {
    progress.value = null;
    return;
  }
  progress.value = { ...progress.value, plan: answer.tour };
  await act('pace', { factor: 1, paused: false });
  await act('link', { delay_s: DELAY_S, jitter_s: 0, loss: 0 });
  for (const [leg, name] of PATTERNS.entries()) {
    await act('pattern', { robot: answer.tour.robots[leg], name });
  }
  await go(1);
}

/** @param {number} step */
export async function go(step) {
  if (!progress.value) return;
  if (seat.peek()?.drives.length) await act('release');
  progress.value = { ...progress.value, step };
  const robot = robotOf(step - 1);
  if (robot) chooseRobots([robot.label]);
}

/**
 * True unless the robot of a leg that has not begun was moved since its goal was chosen.
 * @param {number} leg
 */
export function isAtItsStart(leg) {
  const plan = progress.value?.plan;
  const away = awayFromGoal(leg);
  if (!plan || away === null || progress.value?.began[leg] !== null) return true;
  return Math.abs(away - plan.length_m) < MOVED_M;
}

/** @param {number} leg */
function awayFromGoal(leg) {
  const plan = progress.value?.plan;
  const place = plan && tracks.last(plan.robots[leg]);
  if (!plan || !place) return null;
  return Math.hypot(place.x - plan.goals_m[leg][0], place.y - plan.goals_m[leg][1]);
}

/**
 * Time a leg from the robot's first move until it stands still in the ring.
 * @param {number} leg
 */
export function watchLeg(leg) {
  const now = progress.value;
  const robot = robotOf(leg);
  const place = robot && tracks.last(robot.i);
  if (!now?.plan || !robot || !place || now.took[leg] !== null) return;
  const began = now.began[leg];
  if (began === null) {
    const moves = place.speed > STILL_MPS || Math.abs(rowOf(robot.i)?.set_turn_rate_radps ?? 0) > 0;
    if (drives(robot.i) && moves) progress.value = noted(now, 'began', leg, worldNow());
    return;
  }
  if (place.speed > STILL_MPS || (awayFromGoal(leg) ?? Infinity) > now.plan.radius_m) return;
  const took = worldNow() - began;
  progress.value = noted(now, 'took', leg, took);
  act('tour_time', { robot: robot.i, took_s: took / 1000 });
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
