/** The two sockets: one receives the state, the other sends the person's input. */
import { effect } from '../../vendor/preact.js';
import { connection, notice, reaches, you } from '../store.js';
import { settle, socketLost } from './actions.js';
import { apply } from './apply.js';
import { PAGE, rememberedKey } from './seat_key.js';
import { keepAsking } from './round_trip.js';
import { isDriveSocket, replaceDriveSocket } from './wire.js';

const FIRST_WAIT_MS = 250;
const MAX_WAIT_MS = 4000;
const RESYNC_EVERY_MS = 1000;
const LEAVING = 1001; // the server ends
const REFUSED = 1008; // what this page sends is refused
const LOOK_MS = 1000; // from one look at a socket to the next; it is asked as often
const ATTEMPTS = 3; // looks at which nothing was heard: the link is lost, though nobody said so
const OPENS_WITHIN = 10; // looks

/** @type {WebSocket | null} */
let state = null;
let wait = FIRST_WAIT_MS;
let count = NaN;
let asked = 0;
/** @type {number[]} */
let watched = [];
let looked = { logs: {}, tables: /** @type {string[]} */ ([]) };

/** @param {string} path */
function address(path) {
  return `${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}${path}`;
}

const LOGIN_OVER = 'the login is over';

/** Start listening, for the lifetime of the page. */
export function connect() {
  const old = you.value?.key ?? rememberedKey();
  const query = new URLSearchParams({ page: PAGE, ...(old && { key: old }) });
  const socket = new WebSocket(address(`/ws/state?${query}`));
  count = NaN;
  state = socket;
  let stopAsking = () => {};
  let unheard = 0; // looks
  let first = true;
  const end = (/** @type {{code?: number, reason?: string}} */ why) => {
    stopAsking();
    window.clearInterval(look);
    if (why.code === REFUSED && why.reason === LOGIN_OVER) location.assign('/login');
    socket.onclose = socket.onmessage = null;
    socket.close();
    if (why.code === LEAVING && isAlive()) connection.value = why.reason || 'it was ended';
    else if (isAlive()) connection.value = 'lost';
    notice.value = refusalOf(why) || notice.value;
    window.setTimeout(connect, wait);
    wait = Math.min(MAX_WAIT_MS, 2 * wait);
  };
  const look = window.setInterval(() => {
    unheard += 1;
    if (unheard > (socket.readyState === WebSocket.OPEN ? ATTEMPTS : OPENS_WITHIN)) end({});
  }, LOOK_MS);
  socket.onopen = () => {
    unheard = 0;
    stopAsking = keepAsking(tell);
    tell({ do: 'watch', robots: watched });
    if (isLooking()) tell({ do: 'look', ...looked });
  };
  socket.onmessage = (event) => {
    unheard = 0;
    if (first) connection.value = 'open';
    first = false;
    wait = FIRST_WAIT_MS;
    receive(JSON.parse(event.data));
  };
  socket.onclose = end;
}

/** Reason why the server has refused what a socket sent; empty if it has not. @param {{code?: number, reason?: string}} why */
const refusalOf = ({ code, reason }) => (code === REFUSED ? `The console closed a connection of this page: ${reason}` : '');

/** True unless the simulation is known to have ended. */
const isAlive = () => ['open', 'connecting', 'lost'].includes(connection.value);

/** @param {import('../lines.js').ToPage} line */
function receive(line) {
  if (typeof line.s === 'number') {
    if (line.k !== 'snap' && !Number.isNaN(count) && line.s !== count + 1) resync();
    count = line.s;
  }
  apply(line);
}

/** Request the whole state again, at most once per `RESYNC_EVERY_MS`. */
export function resync() {
  const now = performance.now();
  if (now - asked < RESYNC_EVERY_MS) return;
  asked = now;
  tell({ do: 'resync' });
}

/** @param {object} message */
function tell(message) {
  if (state?.readyState === WebSocket.OPEN) state.send(JSON.stringify(message));
}

/**
 * Report which robots the page is showing.
 * @param {number[]} robots
 */
export function watch(robots) {
  watched = robots;
  tell({ do: 'watch', robots });
}

/**
 * Report which logs the page is showing, each with its filter, and which tables.
 * @param {Record<string, object>} logs
 * @param {string[]} tables
 */
export function look(logs, tables) {
  looked = { logs, tables };
  tell({ do: 'look', ...looked });
}

const isLooking = () => looked.tables.length > 0 || Object.keys(looked.logs).length > 0;

/** Keep the socket for actions open, with the key of the page's seat. */
export function keepDriveSocket() {
  effect(() => {
    const key = you.value?.key;
    reaches.value = false;
    replaceDriveSocket(key ? open(key) : null);
  });
}

/** @param {string} key */
function open(key) {
  const socket = new WebSocket(address(`/ws/drive?key=${encodeURIComponent(key)}`));
  socket.onopen = () => {
    if (isDriveSocket(socket)) reaches.value = true;
  };
  socket.onmessage = (event) => {
    const line = JSON.parse(event.data);
    if (line.k === 'done') settle(line.id ?? '', line);
    else apply(line);
  };
  socket.onclose = (event) => {
    const refusal = refusalOf(event);
    notice.value = refusal || notice.value;
    const unexpected = isDriveSocket(socket);
    if (unexpected) reaches.value = false;
    socketLost(unexpected, refusal || 'The connection was lost before the reply arrived.');
    if (unexpected) window.setTimeout(() => reopen(socket, key), MAX_WAIT_MS / 4);
  };
  return socket;
}

/**
 * Reopen the driving socket, unless another one has replaced it in the meantime.
 * @param {WebSocket} old
 * @param {string} key
 */
function reopen(old, key) {
  if (isDriveSocket(old) && you.value?.key === key) replaceDriveSocket(open(key));
}
