/** Rows of the logs of messages, as they are told: the newest 1,000 of each. */
import { signal } from '../../vendor/preact.js';

const KEPT = 1000;

/** @type {Map<string, import('../../vendor/preact.js').Signal<any[]>>} */
const logs = new Map();

/**
 * Rows of a log, the oldest first: what `brief` in `web/log_entries.py` tells, and `{gap: 1204}`
 * where so many were left out.
 * @param {string} name
 */
export function rowsOf(name) {
  let rows = logs.get(name);
  if (!rows) logs.set(name, (rows = signal([])));
  return rows;
}

/**
 * A line of a log has come.
 * @param {import('../lines.js').Log} line
 */
export function hearLog(line) {
  const known = rowsOf(line.log);
  const old = line.first ? [] : known.value;
  const place = new Map(old.map((row, index) => [row.n, index]));
  const rows = [...old];
  const fresh = [];
  for (const row of line.lines) {
    const index = place.get(row.n);
    if (index === undefined) fresh.push(row);
    else rows[index] = row;
  }
  if (line.missed) rows.push({ gap: line.missed, n: `gap before ${fresh[0]?.n ?? line.log}` });
  known.value = [...rows, ...fresh].slice(-KEPT);
}
