/** What the page Events keeps: which event is looked at, who one is, what is typed as a reason. */
import { computed, signal } from '../../vendor/preact.js';
import { control, events, selection } from '../store.js';
import { eventsInOrder, isOpen } from '../map/shown.js';

const NAME_KEY = 'dva-sim-name';

/** What stands in the field for a reason or a note. */
export const reason = signal('');
/** The place at which an event would be raised [m]. */
export const place = signal(/** @type {[number, number] | null} */ (null));
/** What one is called in the log; kept in this browser. */
export const ownName = signal(localStorage.getItem(NAME_KEY) ?? '');

/** @param {string} name */
export function rename(name) {
  ownName.value = name;
  localStorage.setItem(NAME_KEY, name);
}

/** The event in hand: the one that is chosen, else the gravest that nobody has acknowledged. */
export const inHand = computed(() => {
  const chosen = selection.value;
  const found = chosen?.kind === 'event' && events.value.find((e) => e.number === chosen.key);
  if (found) return found;
  const open = eventsInOrder().filter(isOpen);
  return open.find((event) => !event.acknowledged) ?? open[0] ?? eventsInOrder()[0] ?? null;
});

/** How orders are given: `automatic` or `ask_first`; nothing if the DVA has not said so. */
export const mode = computed(() => control.value?.dispatch?.mode ?? '');
