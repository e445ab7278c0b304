/** Size of the lettering on a map: it grows with the map, to be readable on a wall display. */

const SMALLEST_PX = 11;
const LARGEST_PX = 24;
const UP_TO_PX = 800; // lesser side of a map on which the smallest letters are used

/**
 * Height of the letters on a canvas [px].
 * @param {CanvasRenderingContext2D} ctx
 */
export function lettersOn({ canvas }) {
  const side = Math.min(canvas.width, canvas.height) / window.devicePixelRatio;
  return Math.round(Math.min(LARGEST_PX, Math.max(SMALLEST_PX, (SMALLEST_PX * side) / UP_TO_PX)));
}

/** @typedef {{left: number, top: number, width: number}} Place of words, by their lower left corner */

/**
 * True if words at a place would touch no others.
 * @param {Place[]} written
 * @param {Place} place
 * @param {number} letters their height [px]
 */
export function isFree(written, { left, top, width }, letters) {
  return !written.some(
    (other) =>
      Math.abs(other.top - top) < letters + 2 &&
      other.left < left + width + 3 &&
      left < other.left + other.width + 3,
  );
}
