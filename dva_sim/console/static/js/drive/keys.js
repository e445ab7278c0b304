/** Driving by keys: arrows or W A S D while they are held; Shift slows down. */
import { hold, letGo, onRelease } from './hold.js';
import { isWriting } from '../shell/keys.js';

const WAYS = /** @type {Record<string, [number, number]>} */ ({
  ArrowUp: [1, 0],
  KeyW: [1, 0],
  ArrowDown: [-1, 0],
  KeyS: [-1, 0],
  ArrowLeft: [0, 1],
  KeyA: [0, 1],
  ArrowRight: [0, -1],
  KeyD: [0, -1],
});
const SLOW = 0.4;

/** @param {EventTarget | null} target element that may use the arrow keys itself */
function hasOwnArrows(target) {
  return target instanceof Element && target.matches('input, select, [role=application]');
}

/** Start driving by keys. @returns {() => void} stops it */
export function driveByKeys() {
  /** @type {Set<string>} */
  const down = new Set();
  let slow = false;
  const tell = () => {
    if (!down.size) return letGo('keys');
    const ways = [...down].map((code) => WAYS[code]);
    const factor = slow ? SLOW : 1;
    const sum = (/** @type {0 | 1} */ n) => ways.reduce((total, way) => total + way[n], 0);
    const speed = Math.min(1, Math.max(0, sum(0))) * factor;
    return hold('keys', { speed, turn: Math.min(1, Math.max(-1, sum(1))) * factor });
  };
  const press = (/** @type {KeyboardEvent} */ event) => {
    slow = event.shiftKey;
    if (!(event.code in WAYS) || event.ctrlKey || event.altKey || event.metaKey) return;
    if (isWriting(event.target)) return;
    if (event.code.startsWith('Arrow') && hasOwnArrows(event.target)) return;
    event.preventDefault();
    if (event.repeat) return;
    down.add(event.code);
    tell();
  };
  const release = (/** @type {KeyboardEvent} */ event) => {
    const was = slow;
    slow = event.shiftKey;
    if (down.delete(event.code) || (was !== slow && down.size)) tell();
  };
  window.addEventListener('keydown', press);
  window.addEventListener('keyup', release);
  const end = onRelease(() => down.clear());
  return () => {
    window.removeEventListener('keydown', press);
    window.removeEventListener('keyup', release);
    end();
    letGo('keys');
  };
}
