/** What the page knows of the robots whose windows are open. */
import { computed, signal } from '../../vendor/preact.js';
import { rowOf, windows } from '../store.js';

/** The number of the hand that this page has got last; whose a robot's hand is shows by that. */
export const myHand = signal(/** @type {number | null} */ (null));

/** @param {number} i @returns {import('../lines.js').RobotWindow | undefined} */
export const windowOf = (i) => windows.value.get(i);

/** Whether a robot is in the hands of this page. @param {number} i */
export const isInHand = (i) => {
  const hand = windowOf(i)?.hand ?? null;
  return hand !== null && hand === myHand.value;
};

/** Whether some robot is. */
export const holdsByHand = computed(() => [...windows.value.keys()].some(isInHand));

/** Mode as the robot's own window has it, else as everybody knows it. @param {number} i */
export const shownMode = (i) => windowOf(i)?.mode ?? (rowOf(i)?.by_hand ? 'Manual' : rowOf(i)?.mode) ?? 'Idle';

const DEGREES = 180 / Math.PI;

/** @param {number} radians */
export const degrees = (radians) => radians * DEGREES;

/** Which way a turn rate goes, in words. @param {number} radps to the left positive */
export const side = (radps) => (radps > 0.001 ? 'left' : radps < -0.001 ? 'right' : 'straight');

/** A number without the sign of a zero. @param {number} value @param {number} digits */
export const fixed = (value, digits) => (Number(value.toFixed(digits)) || 0).toFixed(digits);
