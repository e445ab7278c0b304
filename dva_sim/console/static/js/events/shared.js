/** State of the Events page: the current event, the person's name, and the reason being typed. */
import { computed, signal } from '../../vendor/preact.js';
import { control, events, selection } from '../store.js';
import { eventsInOrder, isOpen } from '../map/shown.js';

const NAME_KEY = 'dva-sim-name';

/** Text of the field for a reason or a note. */
export const reason = signal('');
/** Place chosen for a new event [m]. */
export const place = signal(/** @type {[number, number] | null} */ (null));
/** Person's name in the log; kept in this browser. */
export const ownName = signal(localStorage.getItem(NAME_KEY) ?? '');

/** @param {string} name */
export function rename(name) {
  ownName.value = name;
  localStorage.setItem(NAME_KEY, name);
}

/** Current event: the selected one, else the most severe unacknowledged one. */
export const inHand = computed(() => {
  const chosen = selection.value;
  const found = chosen?.kind === 'event' && events.value.find((e) => e.number === chosen.key);
  if (found) return found;
  const open = eventsInOrder().filter(isOpen);
  return open.find((event) => !event.acknowledged) ?? open[0] ?? eventsInOrder()[0] ?? null;
});

/** Dispatch mode, `automatic` or `ask_first`; empty until the DVA reports it. */
export const mode = computed(() => control.value?.dispatch?.mode ?? '');
