/** Keys for the work at the desk; what sends somebody or takes a robot needs Shift. */
import { mayDispatch, maySteer } from '../store.js';
import { isWriting } from '../shell/keys.js';
import { chooseCandidate } from './proposal.js';
import { acknowledge, inHand, isUnseen, openEvents, select } from './shared.js';

/** @type {Record<string, () => void>} */
const DEEDS = {
  j: () => step(1),
  k: () => step(-1),
  a: acknowledgeInHand,
  S: () => press('send'),
  T: () => press('take'),
  r: () => document.getElementById('reason')?.focus(),
};

/** Start listening; return a function that stops it. */
export function workByKeys() {
  const hear = (/** @type {KeyboardEvent} */ event) => {
    if (isWriting(event.target) || event.ctrlKey || event.altKey || event.metaKey || event.repeat) return;
    if (/^[1-9]$/.test(event.key)) chooseCandidate(Number(event.key) - 1);
    else if (DEEDS[event.key]) DEEDS[event.key]();
    else return;
    event.preventDefault();
  };
  window.addEventListener('keydown', hear);
  return () => window.removeEventListener('keydown', hear);
}

/** Take the next event of the list in hand. @param {1 | -1} by */
function step(by) {
  const numbers = openEvents.peek().map((event) => event.number);
  const at = numbers.indexOf(inHand.peek()?.number ?? -1);
  const next = numbers[(Math.max(at, 0) + (at < 0 ? 0 : by) + numbers.length) % numbers.length];
  if (next !== undefined) select(next);
}

function acknowledgeInHand() {
  const event = inHand.peek();
  if (event && isUnseen(event) && mayDispatch.peek() && maySteer.peek()) acknowledge(event);
}

/** @param {string} deed of the button in the panel */
const press = (deed) => /** @type {HTMLButtonElement | null} */ (document.querySelector(`[data-deed=${deed}]`))?.click();

