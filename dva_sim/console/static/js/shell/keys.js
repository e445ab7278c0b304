/** Keys that act on every page. */
import { emergencyStop } from '../net/emergency.js';
import { isPast } from '../store.js';
import { openHelp } from '../help/help.js';

const WRITING = 'input:not([type=range]), textarea, select';

/** Start listening for keys. @param {Record<string, () => void>} deeds by further keys */
export function listenForKeys(deeds) {
  window.addEventListener('keydown', (event) => {
    if (event.key === 'Escape' && event.shiftKey) {
      event.preventDefault();
      if (!event.repeat && !isPast.value) emergencyStop();
    }
    if (isWriting(event.target) || event.ctrlKey || event.altKey || event.metaKey) return;
    if (event.key === '?') openHelp();
    deeds[event.key]?.();
  });
}

/** @param {EventTarget | null} target */
export const isWriting = (target) => target instanceof Element && target.matches(WRITING);
