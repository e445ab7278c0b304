/** The newest state of the world, as signals: components read them, messages write them. */
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
 * What the DVA knows of each device, while a page shows it.
 * @type {import('../vendor/preact.js').Signal<import('./lines.js').DeviceRow[]>}
 */
export const devices = signal([]);
/** @type {import('../vendor/preact.js').Signal<import('./lines.js').Happened[]>} */
export const story = signal([]);
/** @type {import('../vendor/preact.js').Signal<import('./lines.js').Seat | null>} */
export const seat = signal(null);
/**
 * What the windows of robots show, of those that the page looks at.
 * @type {import('../vendor/preact.js').Signal<Map<number, import('./lines.js').RobotWindow>>}
 */
export const windows = signal(new Map());
/**
 * What the guard knows whom this page stands for.
 * @type {import('../vendor/preact.js').Signal<import('./lines.js').Guard | null>}
 */
export const guard = signal(null);
/**
 * How orders are given, and who decides: what control rooms share.
 * @type {import('../vendor/preact.js').Signal<import('./lines.js').Control | null>}
 */
export const control = signal(null);
/** @type {import('../vendor/preact.js').Signal<Omit<import('./lines.js').Alarms, 'k' | 't'>>} */
export const alarmList = signal({ alarms: [], shelved: [], flood: false, rate: 0, left_out: 0 });
/**
 * How the audit log stands; its rows are asked for.
 * @type {import('../vendor/preact.js').Signal<import('./lines.js').Audit | null>}
 */
export const audit = signal(null);
/** @type {import('../vendor/preact.js').Signal<import('./lines.js').You | null>} */
export const you = signal(null);
/** @type {import('../vendor/preact.js').Signal<import('./types.js').Selection>} */
export const selection = signal(null);
/** Whether the world can be heard: 'connecting', 'open', 'lost', or why it has ended. */
export const connection = signal('connecting');
/** Whether the socket is open on which the person's hand reaches the world. */
export const reaches = signal(false);
/** Why there are no camera pictures; empty while there are. */
export const pictures = signal('');
/** What went wrong last, or was refused; empty when there is nothing to tell. */
export const notice = signal('');

/**
 * The recordings that can be chosen, if any can.
 * @type {import('../vendor/preact.js').Signal<import('./lines.js').Shelf | null>}
 */
export const shelf = signal(null);

/** Where everything that moves is; not a signal, for it is drawn, not rendered. */
export const tracks = new Tracks();

/** @type {import('./lines.js').Clock} */
const USUAL = { factor: 1, paused: false, lag_s: 0, given_up_s: 0, held_by_lag: false };
export const clock = computed(() => rows.value?.clock ?? USUAL);
export const link = computed(() => rows.value?.link ?? scene.value?.link ?? null);
/** Whether the link is that of a study, with sliders, and not one of sockets. */
export const isModelled = computed(() => (link.value?.kind ?? 'modelled') === 'modelled');
/** Whether what is shown runs at a DVA elsewhere, of which only messages are known. */
export const isAttached = computed(() => Boolean(scene.value?.attached));
/** How long a command takes at least [ms], as far as it is known. */
export const floorMs = computed(
  () => 1000 * ((link.value?.delay_s ?? 0) + (link.value?.processing_s ?? 0)),
);
/** What is known of the recording that is shown; null where something runs. */
export const replay = computed(() => scene.value?.replay ?? null);
/** Whether the past is shown, in which nobody can be told anything. */
export const isPast = computed(() => Boolean(scene.value && 'replay' in scene.value));
export const robots = computed(
  () => scene.value?.things.filter((thing) => thing.kind === 'robot') ?? [],
);
/** Whether this page's address is one for driving, or for a phone. */
export const mayDrive = computed(() => roleIsOneOf('phone', 'drive', 'dispatch', 'supervise'));
/** Whether it is one of the console's own, and no phone's. */
export const isOperator = computed(() => roleIsOneOf('drive', 'dispatch', 'supervise'));
/** What a DVA elsewhere lets this console do; where the world is the console's own: all. */
export const allowed = computed(() => (isAttached.value ? (rows.value?.server?.role ?? 'look') : 'supervise'));
/** Whether this page's address is one for sending people and robots to events. */
export const isDispatcher = computed(() => roleIsOneOf('dispatch', 'supervise'));
/** Whether people and robots can be sent to events from here. */
export const mayDispatch = computed(
  () => !isPast.value && isDispatcher.value && ['dispatch', 'supervise'].includes(allowed.value),
);
/** Whether robots can be taken from their holders from here. */
export const maySupervise = computed(
  () => !isPast.value && roleIsOneOf('supervise') && allowed.value === 'supervise',
);
/** @param {string[]} roles */
const roleIsOneOf = (...roles) => roles.includes(you.value?.role ?? '');
/** Whether anything can be steered now. */
export const maySteer = computed(
  () => mayDrive.value && connection.value === 'open' && reaches.value && !isPast.value,
);
/** Whether this page may say which moment of a recording is shown. */
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
 * The mode of a robot, as its driver hears it first, else as everybody does.
 * @param {number} i
 */
export const modeOf = (i) => (rowOf(i)?.by_hand ? 'Manual' : driveOf(i)?.mode || rowOf(i)?.mode || 'Idle');
