/** Applies lines from the simulation to the page's state. */
import { batch } from '../../vendor/preact.js';
import { hearLog } from '../logs/log_rows.js';
import {
  alarmList, audit, connection, control, deviceList, events, guard, hazards, pictures, rows, scene, seat, shelf, story,
  tracks,
  windows, you,
} from '../store.js';
import { heardPong } from './round_trip.js';
import { rememberKey } from './seat_key.js';
import { hear, hearAnything } from './world_time.js';

const STORY_KEPT = 200;

/**
 * @typedef {import('../lines.js').ToPage} ToPage
 * @type {{[Kind in ToPage['k']]?: (line: Extract<ToPage, {k: Kind}>) => void}}
 */
const LINES = {
  snap,
  d: (line) => {
    tracks.put(line.p, performance.now());
    tracks.drop(line.gone ?? []);
  },
  rows: (line) => {
    if (line.clock?.jumps !== rows.value?.clock?.jumps) tracks.jump();
    rows.value = line;
  },
  robot: (line) => (windows.value = new Map(windows.value).set(line.i, line)),
  hazards: (line) => (hazards.value = line),
  events: (line) => (events.value = line.events),
  control: (line) => (control.value = line),
  alarms: (line) => (alarmList.value = line),
  audit: (line) => (audit.value = line),
  story_so_far: (line) => (story.value = line.lines),
  shelf: (line) => (shelf.value = line),
  story: (line) => (story.value = [...story.value, line].slice(-STORY_KEPT)),
  seat: (line) => {
    if ('drives' in line && line.seat === you.value?.client) seat.value = line;
  },
  guard: (line) => {
    if (line.seat === you.value?.client) guard.value = line.label ? line : null;
  },
  you: (line) => {
    you.value = line;
    rememberKey(line.key);
  },
  pictures: (line) => (pictures.value = line.ok ? '' : line.text),
  devices: (line) => (deviceList.value = line),
  log: hearLog,
  pong: heardPong,
  bye: (line) => (connection.value = line.why || 'the world has ended'),
};

/**
 * Apply a line.
 * @param {ToPage} line
 */
export function apply(line) {
  if ('t' in line && typeof line.t === 'number') hear(line.t);
  else hearAnything();
  batch(() => take(line));
}

/** @param {ToPage} line */
function take(line) {
  const does = /** @type {((line: ToPage) => void) | undefined} */ (LINES[line.k]);
  does?.(line);
}

/** @param {import('../lines.js').Snap} line */
function snap(line) {
  if (line.scene) scene.value = line.scene;
  story.value = [];
  seat.value = null;
  guard.value = null;
  windows.value = new Map();
  const { pos, story: lines, story_from: _, seats: __, ...others } = line.state;
  if (pos) {
    tracks.put(pos, performance.now());
    tracks.keep(new Set(pos.map((row) => row[0])));
  }
  if (lines) story.value = lines.slice(-STORY_KEPT);
  for (const newest of Object.values(others)) take(newest);
}
