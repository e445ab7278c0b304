/** Requests page: requests received by the DVA, and its replies. */
import { html, useEffect, useState } from '../../vendor/preact.js';
import { isPast, rows as worldRows } from '../store.js';
import { useLog } from '../logs/looking.js';
import { MessageDetail } from './message_detail.js';
import { ALL, isNarrow, RequestFilters } from './request_filters.js';
import { countText, RequestTable } from './request_table.js';
import { ServerBar } from './server_bar.js';

const LOG = 'dva';
const SHOWN = 200;
const WAIT_MS = 250;

/** @typedef {import('./request_filters.js').LogFilter} LogFilter */

/** Reasons why a DVA's log cannot be shown, by its state. */
const WITHOUT = /** @type {Record<string, (server: any) => string>} */ ({
  unknown: () => 'Waiting for the log of the DVA …',
  not_kept: () => 'This DVA keeps no log for control rooms.',
  not_permitted: ({ role }) => `This DVA shows its log to control rooms with the role drive. This console has the role ${role}.`,
});

/** The page. */
export function RequestsPage() {
  const [asked, setFilter] = useState(ALL);
  const [own, showOwn] = useState(false);
  const server = worldRows.value?.server;
  const filter = { ...asked, without: own ? '' : (server?.console ?? '') };
  const rows = useLog(LOG, useSettled(filter));
  const [paused, setPaused] = useState(/** @type {any[] | null} */ (null));
  const [older, setOlder] = useState(/** @type {any[]} */ ([]));
  const [chosen, choose] = useState(/** @type {number | null} */ (null));
  const change = (/** @type {Partial<LogFilter>} */ more) => {
    setFilter({ ...asked, ...more });
    setOlder([]);
    setPaused(null);
  };
  const shown = paused ?? [...older, ...rows.slice(-SHOWN)];
  const newest = rows.filter((row) => !row.gap).at(-1)?.n ?? filter.since;
  const first = shown.find((row) => !row.gap)?.n;
  const without = WITHOUT[server?.log ?? 'kept']?.(server);
  const more = async () => setOlder([...(await ask(filter, first)), ...older]);
  return html`<main class="page requests-page" id="main" tabindex="-1">
    <h1 class="hidden">Main</h1>
    ${!isPast.value && html`<${ServerBar} />`}
    <section class="panel requests" aria-label="Log">
      <${RequestFilters} own=${own} onOwn=${(/** @type {boolean} */ show) => (change({}), showOwn(show))} filter=${filter} kinds=${kindsOf(shown)} onFilter=${change}
        isPaused=${paused !== null} onPause=${() => setPaused(paused ? null : shown)}
        onClear=${() => change({ since: newest })} exported=${`/api/logs/${LOG}/export?${query(filter)}`} />
      ${without
        ? html`<p class="soft empty">${without}</p>`
        : html`<${RequestTable} rows=${shown} chosen=${chosen} onChoose=${choose}
            older=${shown.length >= SHOWN && !paused && html`<button type="button" key="older" class="wide" onClick=${more}>Show older</button>`} />`}
      <${Counts} shown=${shown} paused=${paused} rows=${rows} filter=${filter} />
    </section>
    <${MessageDetail} log=${LOG} row=${[...older, ...rows].find((row) => row.n === chosen) ?? shown.find((row) => row.n === chosen)} />
  </main>`;
}

/**
 * Filter, updated once typing has paused for a moment.
 * @param {LogFilter} filter
 */
function useSettled(filter) {
  const [settled, setSettled] = useState(filter);
  useEffect(() => {
    const timer = window.setTimeout(() => setSettled(filter), WAIT_MS);
    return () => window.clearTimeout(timer);
  }, [JSON.stringify(filter)]);
  return settled;
}

/** @param {{shown: any[], paused: any[] | null, rows: any[], filter: LogFilter}} props */
function Counts({ shown, paused, rows, filter }) {
  const lines = shown.filter((row) => !row.gap).length;
  const last = paused?.filter((row) => !row.gap).at(-1)?.n ?? 0;
  const waiting = paused ? rows.filter((row) => !row.gap && row.n > last).length : 0;
  return html`<p class="soft" role="status" aria-label="Shown">${countText(lines)} shown${
    isNarrow(filter) ? ', as filtered' : ''}${paused ? `; paused, ${countText(waiting)} more have come` : ''}</p>`;
}

/** @param {any[]} rows */
const kindsOf = (rows) => [...new Set(rows.filter((row) => !row.gap).map((row) => String(row.kind)))];

/** @param {LogFilter} filter */
const query = (filter) =>
  new URLSearchParams(Object.entries(filter).map(([key, value]) => [key, String(value)])).toString();

/**
 * @param {LogFilter} filter
 * @param {number} before
 * @returns {Promise<any[]>}
 */
async function ask(filter, before) {
  try {
    const answer = await fetch(`/api/logs/${LOG}?${query(filter)}&before=${before}`);
    return answer.ok ? (await answer.json()).lines : [];
  } catch {
    return [];
  }
}
