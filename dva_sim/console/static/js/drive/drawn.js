/** Newest picture of each robot that this page has drawn, and so its user has seen. */
import { shownTime } from '../net/world_time.js';

/** Capture times by robot, in simulation time [ms]. @type {Map<number, number>} */
const drawn = new Map();

/** Times of arrival by robot, on this page's clock [ms]. @type {Map<number, number>} */
const arrived = new Map();

/**
 * Record that a picture has been drawn.
 * @param {number} robot
 * @param {number} capturedMs NaN if it is from a robot whose clock is unknown
 */
export function drew(robot, capturedMs) {
  drawn.set(robot, capturedMs);
  arrived.set(robot, performance.now());
}

/** Forget a robot whose pictures are no longer on the page. @param {number} robot */
export function drawsNoMore(robot) {
  drawn.delete(robot);
  arrived.delete(robot);
}

/** Age of the newest picture of a robot [ms]. @param {number} robot */
export function pictureAge(robot) {
  return Math.max(0, shownTime() - (drawn.get(robot) ?? NaN));
}

/** Time since the newest picture of a robot arrived [ms]; NaN if none has. @param {number} robot */
export const sinceArrived = (robot) => performance.now() - (arrived.get(robot) ?? NaN);

/** Capture times sent with each input: the age of a command includes that of the picture behind it. */
export const seenPictures = () => [...drawn].filter(([, at]) => Number.isFinite(at));
