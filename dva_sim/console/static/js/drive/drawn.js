/** The pictures that this page has drawn last: what its person has seen of each robot. */
import { worldNow } from '../net/world_time.js';

/** When they were taken by robot, in the world's time [ms]. @type {Map<number, number>} */
const drawn = new Map();

/**
 * A picture has been drawn.
 * @param {number} robot
 * @param {number} capturedMs
 */
export const drew = (robot, capturedMs) => void drawn.set(robot, capturedMs);

/** No picture of a robot is on the page any more. @param {number} robot */
export const drawsNoMore = (robot) => void drawn.delete(robot);

/** How old the newest picture of a robot is [ms]. @param {number} robot */
export function pictureAge(robot) {
  const at = drawn.get(robot);
  return at === undefined ? NaN : Math.max(0, worldNow() - at);
}

/** What goes with each input, so that a command is as old as the picture that it was given by. */
export const seenPictures = () => [...drawn].filter(([, at]) => Number.isFinite(at));
