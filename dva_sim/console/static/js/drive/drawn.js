/** Newest picture of each robot that this page has drawn, and so its user has seen. */
import { shownTime } from '../net/world_time.js';

/** Capture times by robot, in simulation time [ms]. @type {Map<number, number>} */
const drawn = new Map();

/**
 * Record that a picture has been drawn.
 * @param {number} robot
 * @param {number} capturedMs
 */
export const drew = (robot, capturedMs) => void drawn.set(robot, capturedMs);

/** Forget a robot whose pictures are no longer on the page. @param {number} robot */
export const drawsNoMore = (robot) => void drawn.delete(robot);

/** Age of the newest picture of a robot [ms]. @param {number} robot */
export function pictureAge(robot) {
  return Math.max(0, shownTime() - (drawn.get(robot) ?? NaN));
}

/** Capture times sent with each input: the age of a command includes that of the picture behind it. */
export const seenPictures = () => [...drawn].filter(([, at]) => Number.isFinite(at));
