/** State of the Events page: the list, the event in hand, the person's name, and the reason being typed. */
import { computed, signal } from '../../vendor/preact.js';
import { alarmList, control, events, selection, you } from '../store.js';
import { act } from '../net/actions.js';
import { eventsInOrder, isOpen } from '../map/shown.js';

/** @typedef {import('../lines.js').SiteEvent} SiteEvent */

const NAME_KEY = 'dva-sim-name';

/** Text of the field for a reason or a note. */
export const reason = signal('');
/** True while the shift is shown in place of the event in hand. */
export const onShift = signal(false);
/** True while a place for a new event is chosen. */
export const raising = signal(false);
/** Place chosen for a new event [m]. */
export const place = signal(/** @type {[number, number] | null} */ (null));
/** Person's name in the log; kept in this browser. */
export const ownName = signal(localStorage.getItem(NAME_KEY) ?? '');

/** @param {string} name */
export function rename(name) {
  ownName.value = name;
  localStorage.setItem(NAME_KEY, name);
}

/** Label of this page's control room, as the log shows it; empty until it has joined. */
export const ownRoom = computed(
  () => control.value?.rooms?.find((room) => room.client === you.value?.client)?.label ?? '',
);

export const FILTERS = ['mine', 'open', 'all'];
/** Filter of the list: the events that this person answers for, the open ones, or all. */
export const filter = signal('open');

/** Names of the other persons who decide. */
export const colleagues = computed(() =>
  (control.value?.rooms ?? []).filter((room) => room.client !== you.value?.client).map((room) => room.label),
);

/** Person who answers for an event: who took it over last, else who acknowledged it. @param {SiteEvent} event */
export const ownerOf = (event) =>
  control.value?.owners?.find((one) => one.event === event.number)?.label ?? event.acknowledged?.label ?? '';

/**
 * True while nobody has acknowledged an open event, or not since it became more severe.
 * @param {SiteEvent} event
 */
export const isUnseen = (event) => isOpen(event) && (!event.acknowledged || alarmOf(event)?.state === 'unacknowledged');

/** @param {SiteEvent} event */
const alarmOf = (event) => alarmList.value.alarms.find((alarm) => alarm.event === event.number);

/** Acknowledge an event: at the DVA, or here if it has only become more severe. @param {SiteEvent} event */
export const acknowledge = (event) => (event.acknowledged
  ? act('alarm_acknowledge', { alarm: `event ${event.number}` })
  : act('event_acknowledge', { event: event.number }));

/** Shelf of an event's alarm; undefined if it is on none. @param {SiteEvent} event */
export const shelfOf = (event) => alarmList.value.shelved.find((alarm) => alarm.event === event.number);

/** @param {SiteEvent} event */
const isMine = (event) => [ownerOf(event), event.decided?.label].includes(ownRoom.value);

const shelvedEvents = computed(() => new Set(alarmList.value.shelved.map((alarm) => alarm.event)));

/** Open events of the list, the most severe first; shelved ones only if all are listed. */
export const openEvents = computed(() => {
  const open = eventsInOrder().filter(isOpen);
  if (filter.value === 'all') return open;
  const listed = open.filter((event) => !shelvedEvents.value.has(event.number));
  return filter.value === 'mine' ? listed.filter(isMine) : listed;
});

const ENDINGS = ['escalated', 'confirmed', 'contained', 'refuted', 'expired'];

/** Closed events by how they ended, in each the newest first. @type {import('../../vendor/preact.js').Signal<[string, SiteEvent[]][]>} */
export const closedEvents = computed(() => {
  const endings = /** @type {Record<string, SiteEvent[]>} */ ({});
  for (const event of [...events.value].reverse()) {
    if (isOpen(event) || (filter.value === 'mine' && !isMine(event))) continue;
    (endings[event.state] ??= []).push(event);
  }
  const rank = (/** @type {string} */ ending) => (ENDINGS.indexOf(ending) + ENDINGS.length + 1) % (ENDINGS.length + 1);
  return Object.entries(endings).sort(([one], [other]) => rank(one) - rank(other));
});

/** Event in hand: the selected one, else the most severe unacknowledged one. */
export const inHand = computed(() => {
  const chosen = selection.value;
  const found = chosen?.kind === 'event' && events.value.find((event) => event.number === chosen.key);
  if (found) return found;
  const open = eventsInOrder().filter(isOpen);
  return open.find(isUnseen) ?? open[0] ?? eventsInOrder()[0] ?? null;
});

/** @param {number} number of the event to take in hand */
export function select(number) {
  selection.value = { kind: 'event', key: number };
  raising.value = false;
  onShift.value = false;
}

/** Dispatch mode, `automatic` or `ask_first`; empty until the DVA reports it. */
export const mode = computed(() => control.value?.dispatch?.mode ?? '');
