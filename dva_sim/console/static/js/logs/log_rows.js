/** Rows of the message logs as received: the newest 1,000 of each. */
import { signal } from '../../vendor/preact.js';

const KEPT = 1000;

/** @type {Map<string, import('../../vendor/preact.js').Signal<any[]>>} */
const logs = new Map();

/**
 * Rows of a log, oldest first: entries made by `brief` in `web/log_entries.py`, and `{gap: 1204}`
 * where 1,204 were left out.
 * @param {string} name
 */
export function rowsOf(name) {
  let rows = logs.get(name);
  if (!rows) logs.set(name, (rows = signal([])));
  return rows;
}

/**
 * Add a received line to its log.
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
