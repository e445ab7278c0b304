/** State of the robots whose pages are open. */
import { computed, signal } from '../../vendor/preact.js';
import { windows } from '../store.js';

/** Number of this page's latest manual control; a robot with the same number is controlled by this page. */
export const myHand = signal(/** @type {number | null} */ (null));

/** @param {number} i @returns {import('../lines.js').RobotWindow | undefined} */
export const windowOf = (i) => windows.value.get(i);

/** True if this page controls a robot manually. @param {number} i */
export const isInHand = (i) => {
  const hand = windowOf(i)?.hand ?? null;
  return hand !== null && hand === myHand.value;
};

/** True if this page controls any robot manually. */
export const holdsByHand = computed(() => [...windows.value.keys()].some(isInHand));

const DEGREES = 180 / Math.PI;

/** @param {number} radians */
export const degrees = (radians) => radians * DEGREES;

/** Direction of a turn rate, in words. @param {number} radps to the left positive */
export const side = (radps) => (radps > 0.001 ? 'left' : radps < -0.001 ? 'right' : 'straight');

/** A number without the sign of a zero. @param {number} value @param {number} digits */
export const fixed = (value, digits) => (Number(value.toFixed(digits)) || 0).toFixed(digits);
