/** Alarms that nobody has acknowledged, and the ways to call for them without a page of one's own. */
import { computed, effect } from '../../vendor/preact.js';
import { alarmList, isPast } from '../store.js';

export const RANKS = ['low', 'medium', 'high', 'critical'];
const PATTERN_MS = [300, 150, 300]; // on, off, on

export const unseen = computed(() =>
  isPast.value ? [] : alarmList.value.alarms.filter((alarm) => alarm.state === 'unacknowledged'),
);

/**
 * Do something about each alarm that is new or has become worse since the page was opened.
 * @param {(worst: import('../lines.js').AlarmRow) => void} act
 */
export function callByAlarms(act) {
  let known = /** @type {Map<string, number> | null} */ (null);
  effect(() => {
    const ranks = new Map(unseen.value.map((alarm) => [alarm.key, RANKS.indexOf(alarm.priority)]));
    const worse = unseen.value.filter((alarm) => (known?.get(alarm.key) ?? -1) < RANKS.indexOf(alarm.priority));
    if (known && worse.length) act(worse[0]);
    known = ranks;
  });
}

/**
 * Have the phone of somebody on call vibrate for alarms and orders.
 * @param {() => boolean} isOnCall
 * @param {() => unknown} order number of the order in hand, if any
 */
export function vibrateFor(isOnCall, order) {
  const isAllowed = () => navigator.userActivation?.hasBeenActive ?? true; // not before the first tap
  const vibrate = () => isOnCall() && isAllowed() && navigator.vibrate?.(PATTERN_MS);
  callByAlarms(vibrate);
  let known = order();
  effect(() => {
    const now = order();
    if (now && now !== known) vibrate();
    known = now;
  });
}
