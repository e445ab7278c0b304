/** Latest state of the simulation, as signals: components read them, messages write them. */
import { computed, signal } from '../vendor/preact.js';
import { Tracks } from './map/tracks.js';

/** @type {import('../vendor/preact.js').Signal<import('./lines.js').Scene | null>} */
export const scene = signal(null);
/** @type {import('../vendor/preact.js').Signal<import('./lines.js').Rows | null>} */
export const rows = signal(null);
/** @type {import('../vendor/preact.js').Signal<Pick<import('./lines.js').Hazards, 'hazards' | 'fields'>>} */
export const hazards = signal({ hazards: [], fields: [] });
/** @type {import('../vendor/preact.js').Signal<import('./lines.js').SiteEvent[]>} */
export const events = signal([]);
/**
 * Devices as the DVA reports them, while a page shows them.
 * @type {import('../vendor/preact.js').Signal<Omit<import('./lines.js').Devices, 'k'>>}
 */
export const deviceList = signal({ t: 0, devices: [] });
/** @type {import('../vendor/preact.js').Signal<import('./lines.js').Happened[]>} */
export const story = signal([]);
/** @type {import('../vendor/preact.js').Signal<import('./lines.js').Seat | null>} */
export const seat = signal(null);
/**
 * Detailed state of the robots that the page is showing.
 * @type {import('../vendor/preact.js').Signal<Map<number, import('./lines.js').RobotWindow>>}
 */
export const windows = signal(new Map());
/**
 * State of the guard whom this page plays; null if it plays none.
 * @type {import('../vendor/preact.js').Signal<import('./lines.js').Guard | null>}
 */
export const guard = signal(null);
/**
 * State shared by control rooms: how orders are given, and who decides.
 * @type {import('../vendor/preact.js').Signal<import('./lines.js').Control | null>}
 */
export const control = signal(null);
/** @type {import('../vendor/preact.js').Signal<Omit<import('./lines.js').Alarms, 'k'>>} */
export const alarmList = signal({ t: 0, alarms: [], shelved: [], flood: false, rate: 0, left_out: 0 });
/**
 * State of the audit log; its rows are requested separately.
 * @type {import('../vendor/preact.js').Signal<import('./lines.js').Audit | null>}
 */
export const audit = signal(null);
/** @type {import('../vendor/preact.js').Signal<import('./lines.js').You | null>} */
export const you = signal(null);
/** @type {import('../vendor/preact.js').Signal<import('./types.js').Selection>} */
export const selection = signal(null);
/** State of the connection: 'connecting', 'open', 'lost', or the reason why the simulation ended. */
export const connection = signal('connecting');
/** True while the driving socket is open. */
export const reaches = signal(false);
/** Reason why there are no camera pictures; empty while there are. */
export const pictures = signal('');
/** Latest problem or refusal; empty if there is none. */
export const notice = signal('');

/**
 * Recordings to choose from, if any.
 * @type {import('../vendor/preact.js').Signal<import('./lines.js').Shelf | null>}
 */
export const shelf = signal(null);

/** Positions of everything that moves; not a signal, since they are drawn and not rendered. */
export const tracks = new Tracks();

/** @type {import('./lines.js').Clock} */
const USUAL = { factor: 1, paused: false, lag_s: 0, given_up_s: 0, held_by_lag: false };
export const clock = computed(() => rows.value?.clock ?? USUAL);
export const link = computed(() => rows.value?.link ?? scene.value?.link ?? null);
/** True if the link is simulated and can be adjusted; false for real sockets. */
export const isModelled = computed(() => (link.value?.kind ?? 'modelled') === 'modelled');
/** True if the console shows a DVA running elsewhere, known only from its messages. */
export const isAttached = computed(() => Boolean(scene.value?.attached));
/** True if that DVA is on the bench of the console, which starts and stops its server. */
export const isBeside = computed(() => isAttached.value && rows.value?.server?.own !== false);
/** Minimum latency of a command [ms], from the known delay and processing time. */
export const floorMs = computed(
  () => 1000 * ((link.value?.delay_s ?? 0) + (link.value?.processing_s ?? 0)),
);
/** Description of the recording being shown; null if there is none. */
export const replay = computed(() => scene.value?.replay ?? null);
/** True if the page shows recordings, which accept no commands. */
export const isPast = computed(() => Boolean(scene.value && 'replay' in scene.value));
export const robots = computed(
  () => scene.value?.things.filter((thing) => thing.kind === 'robot') ?? [],
);
/** True if this page's address permits driving, from the console or from a phone. */
export const mayDrive = computed(() => roleIsOneOf('phone', 'drive', 'dispatch', 'supervise'));
/** True if this page's address is one of the console's own, not a phone's. */
export const isOperator = computed(() => roleIsOneOf('drive', 'dispatch', 'supervise'));
/** Role that a remote DVA grants this console; all rights in the console's own simulation. */
export const allowed = computed(() => (isAttached.value ? (rows.value?.server?.role ?? 'look') : 'supervise'));
/** True if this page's address permits sending people and robots to events. */
export const isDispatcher = computed(() => roleIsOneOf('dispatch', 'supervise'));
/** True if people and robots can be sent to events from this page. */
export const mayDispatch = computed(
  () => !isPast.value && isDispatcher.value && ['dispatch', 'supervise'].includes(allowed.value),
);
/** True if robots can be taken from their holders from this page. */
export const maySupervise = computed(
  () => !isPast.value && roleIsOneOf('supervise') && allowed.value === 'supervise',
);
/** True if robots can be released after an emergency from this page. */
export const mayRelease = computed(() => (scene.value?.pages ? !isPast.value && isOperator.value : mayDispatch.value));
/** @param {string[]} roles */
const roleIsOneOf = (...roles) => roles.includes(you.value?.role ?? '');
/** True if commands can be sent now. */
export const maySteer = computed(
  () => mayDrive.value && connection.value === 'open' && reaches.value && !isPast.value,
);
/** True if this page may control which moment of a recording is shown. */
export const maySteerReplay = computed(() => mayDrive.value && connection.value === 'open');

const robotRows = computed(
  () => new Map((rows.value?.robots ?? []).map((row) => [row.i, row])),
);
const doings = computed(
  () => new Map((rows.value?.people ?? []).map((person) => [person.i, person.doing])),
);

/** @param {number | null} i */
export const thingAt = (i) => scene.value?.things.find((thing) => thing.i === i);
/** @param {string} label */
export const thingNamed = (label) => scene.value?.things.find((thing) => thing.label === label);
/** @param {number | null} i */
export const rowOf = (i) => (i === null ? undefined : robotRows.value.get(i));
/** @param {number} i */
export const doingOf = (i) => doings.value.get(i) ?? '';
/** @param {number} i */
export const driveOf = (i) => seat.value?.drives.find((drive) => drive.i === i);
/**
 * Mode of a robot: `Lost` if the DVA has lost it, an emergency or manual control as reported to all
 * pages, else as reported to this page as its driver.
 * @param {number} i
 */
export const modeOf = (i) => {
  const shown = rowOf(i)?.silent ? 'Lost' : rowOf(i)?.mode || 'Idle';
  if (shown === 'Lost') return shown;
  return ['Emergency', 'Manual'].includes(shown) ? shown : driveOf(i)?.mode || shown;
};
/** Reason why a robot cannot be started; empty if no emergency holds it, or a start releases it. @param {number | null} i */
export const whyStopped = (i) => {
  const emergency = rowOf(i)?.emergency;
  if (!emergency || emergency.released_by === 'drive') return '';
  return `${emergency.by} has stopped it by an emergency: a dispatcher has to release it first.`;
};
