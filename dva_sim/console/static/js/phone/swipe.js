/** Swipes over the picture: up starts, down stops; also tracks whether a thumb is on it. */
import { press, start, stop } from './drive.js';

const FAR_PX = 56;
const STEEP = 1.5; // up or down, rather than to a side

/** Handlers for the picture. */
export function swipes() {
  /** @type {{id: number, x: number, y: number, done: boolean} | null} */
  let touch = null;
  const down = (/** @type {PointerEvent} */ event) => {
    if (touch || event.button !== 0) return;
    /** @type {HTMLElement} */ (event.currentTarget).setPointerCapture(event.pointerId);
    touch = { id: event.pointerId, x: event.clientX, y: event.clientY, done: false };
    press(true);
  };
  const move = (/** @type {PointerEvent} */ event) => {
    if (!touch || event.pointerId !== touch.id || touch.done) return;
    const [right, below] = [event.clientX - touch.x, event.clientY - touch.y];
    if (Math.abs(below) < FAR_PX || Math.abs(below) < STEEP * Math.abs(right)) return;
    touch.done = true;
    if (below < 0) start();
    else stop();
  };
  const up = (/** @type {PointerEvent} */ event) => {
    if (event.pointerId !== touch?.id) return;
    touch = null;
    press(false);
  };
  return {
    onPointerDown: down,
    onPointerMove: move,
    onPointerUp: up,
    onPointerCancel: up,
    onLostPointerCapture: up,
  };
}
