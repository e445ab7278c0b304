/**
 * Logs and tables shown by this page; the server sends no others.
 *
 * `useLog('robot-1', {kind: 'SetTeleOp', publications: true})` returns the rows of a log (`rowsOf`)
 * for as long as a component shows it: the newest, then additions, up to five times a second.
 */
import { useEffect } from '../../vendor/preact.js';
import { look } from '../net/sockets.js';
import { rowsOf } from './log_rows.js';

/** @type {Map<string, {users: number, filter: object}>} */
const logs = new Map();
/** @type {Map<string, number>} */
const tables = new Map();

/** @param {string} name */
function logOf(name) {
  let log = logs.get(name);
  if (!log) logs.set(name, (log = { users: 0, filter: {} }));
  return log;
}

/**
 * Rows of a log, the oldest first.
 * @param {string} name
 * @param {object} [filter]
 * @returns {any[]}
 */
export function useLog(name, filter = {}) {
  const wanted = JSON.stringify(filter);
  useEffect(() => {
    const log = logOf(name);
    log.users += 1;
    log.filter = JSON.parse(wanted);
    tell();
    return () => {
      log.users -= 1;
      tell();
    };
  }, [name, wanted]);
  return rowsOf(name).value;
}

/**
 * Subscribe to a table, sent only to pages that show it, while a component is mounted.
 * @param {string} name
 */
export function useTable(name) {
  useEffect(() => {
    tables.set(name, (tables.get(name) ?? 0) + 1);
    tell();
    return () => {
      tables.set(name, (tables.get(name) ?? 1) - 1);
      tell();
    };
  }, [name]);
}

let waits = false;

/** Send the subscriptions once, after all components have registered theirs. */
function tell() {
  if (waits) return;
  waits = true;
  queueMicrotask(() => {
    waits = false;
    const shown = [...logs].filter(([, log]) => log.users > 0);
    look(
      Object.fromEntries(shown.map(([name, log]) => [name, log.filter])),
      [...tables].filter(([, users]) => users > 0).map(([name]) => name),
    );
  });
}

