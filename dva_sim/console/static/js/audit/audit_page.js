/** Audit page: the log of decisions, its verification, and the measures derived from it. */
import { html, useEffect, useState } from '../../vendor/preact.js';
import { audit } from '../store.js';
import { Field } from '../ui/fields.js';
import { clockText, plain, secondsText } from '../ui/words.js';

/** @typedef {import('../lines.js').AuditRow} AuditRow */
/** @typedef {import('../lines.js').AuditCheck} AuditCheck */
/** @typedef {import('../lines.js').AuditMeasures} AuditMeasures */

const SHOWN = 1000;
const CHECK_MS = 10000;
const HEADS = ['No.', 'Time', 'Who', 'Role', 'What', 'Event', 'Whom', 'Why', 'Outcome', 'Words'];

/** The page. */
export function AuditPage() {
  const [rows, setRows] = useState(/** @type {AuditRow[]} */ ([]));
  const [check, setCheck] = useState(/** @type {AuditCheck | null} */ (null));
  const [measures, setMeasures] = useState(/** @type {AuditMeasures | null} */ (null));
  const [problem, setProblem] = useState('');
  const [filter, setFilter] = useState('');
  const number = audit.value?.rows ?? 0;
  const look = async () => {
    const [checked, measured] = await Promise.all([ask('/api/audit/check'), ask('/api/audit/measures')]);
    setCheck(checked.body);
    setMeasures(measured.body);
    setProblem(checked.problem);
  };
  useEffect(() => {
    read(rows, number).then(setRows);
  }, [number]);
  useEffect(() => {
    look();
    const timer = window.setInterval(() => document.hidden || look(), CHECK_MS);
    return () => window.clearInterval(timer);
  }, [number]);
  const shown = rows.filter((row) => fits(row, filter));
  return html`<main class="page audit-page" id="main" tabindex="-1">
    <h1>Audit</h1>
    <${State} check=${check} problem=${problem} look=${look} />
    ${measures && html`<${Measures} measures=${measures} />`}
    <div class="audit-tools">
      <${Field} name="Filter" value=${filter} onInput=${setFilter} hint="Words to find in a row" />
      <a class="button" href="/api/audit.csv" download>Export as CSV</a>
      <a class="button" href="/api/audit.json" download>Export as JSON</a>
    </div>
    <${Table} rows=${shown} wrong=${check?.problem?.row ?? Infinity} />
  </main>`;
}

/**
 * Fetch JSON from the server; return the body, or the problem.
 * @param {string} path
 * @returns {Promise<{body: any, problem: string}>}
 */
async function ask(path) {
  try {
    const answer = await fetch(path);
    const body = await answer.json();
    return answer.ok ? { body, problem: '' } : { body: null, problem: body.text };
  } catch {
    return { body: null, problem: 'The server does not answer.' };
  }
}

/**
 * Newest rows: those already loaded, and those added since.
 * @param {AuditRow[]} rows
 * @param {number} number
 */
async function read(rows, number) {
  let known = rows;
  let after = Math.max(known.at(-1)?.number ?? 0, number - SHOWN);
  for (;;) {
    const { body } = await ask(`/api/audit?after=${after}`);
    if (!body) return known;
    known = [...known, ...body.rows].slice(-SHOWN);
    if (!body.more) return known;
    after = known.at(-1)?.number ?? after;
  }
}

/** @param {AuditRow} row @param {string} filter */
function fits(row, filter) {
  const text = [row.author, row.role, plain(row.action), row.event ?? '', row.subject, row.cause,
    row.outcome, row.text].join(' ').toLowerCase();
  return filter.toLowerCase().split(/\s+/).every((word) => text.includes(word));
}

/** @param {{check: AuditCheck | null, problem: string, look: () => void}} props */
function State({ check, problem, look }) {
  const writing = audit.value?.problem;
  const wrong = check?.problem;
  const text = problem || (check ? stateText(check) : 'Reading the log …');
  return html`<section class=${`panel audit-state ${wrong || problem ? 'broken' : ''}`} aria-label="Verification">
    <p role="status" aria-label="Verification">${text}</p>
    ${check && !wrong && html`<p class="soft">The last hash is <code>${check.hash}</code>.</p>`}
    ${check?.doubts.map((doubt) => html`<p class="soft">Odd: ${doubt}.</p>`)}
    ${writing && html`<p class="warning" role="alert">${writing}. No actions are accepted until it can be written.</p>`}
    <p class="soft">${audit.value?.lasting ? `Saved in ${audit.value.file}.` : 'It is lost when the console ends. Start the console with --audit FILE.sqlite to keep it.'}</p>
    <button type="button" onClick=${look}>Verify</button></section>`;
}

/** @param {AuditCheck} check */
function stateText(check) {
  if (check.problem) return `Broken: row ${check.problem.row} ${check.problem.text}.`;
  return `Verified: ${check.rows} ${check.rows === 1 ? 'row' : 'rows'}, none changed, removed or moved.`;
}

/** @param {{measures: AuditMeasures}} props */
function Measures({ measures }) {
  const { acknowledge, assign } = measures;
  return html`<section class="measures" aria-label="Measures"><dl>
    <div><dt>Time to acknowledge</dt><dd>${times(acknowledge)}</dd></div>
    <div><dt>Time to assign</dt><dd>${times(assign)}</dd></div>
    <div><dt>Assigned by people, by the policy</dt><dd>${measures.assigned_by_people}, ${measures.assigned_by_policy}</dd></div>
    <div><dt>Overrides of the policy</dt><dd>${measures.overrides}${
      measures.lost_s === null ? '' : `, expected ${Math.abs(measures.lost_s)} s ${measures.lost_s < 0 ? 'earlier' : 'later'} (median)`
    }</dd></div></dl>
    ${measures.newest_overrides.length > 0 &&
    html`<details><summary>What the policy would have done</summary><ul>${measures.newest_overrides.map(
      (one) => html`<li key=${one.number}>Row ${one.number}, event ${one.event}: ${one.author} sent ${one.did} (${expected(one.did_s)});
        the policy ${one.advised ? `would have sent ${one.advised} (${expected(one.advised_s)})` : 'would have sent nobody'}${one.cause ? `. ${one.cause}` : ''}</li>`,
    )}</ul></details>`}</section>`;
}

/** @param {number | null} seconds */
const expected = (seconds) => (seconds === null || seconds === undefined ? 'time unknown' : secondsText(seconds));

/** @param {import('../lines.js').TimesTaken} found */
function times({ events, median_s: median, largest_s: largest }) {
  if (!events || median === null || largest === null) return '–';
  return `${secondsText(median)} median, ${secondsText(largest)} largest, ${events} ${events === 1 ? 'event' : 'events'}`;
}

/** @param {{rows: AuditRow[], wrong: number}} props */
function Table({ rows, wrong }) {
  const newest = [...rows].reverse();
  return html`<div class="scroll" tabindex="0" role="group" aria-label="Rows of the audit log">
    <table aria-label="Audit log"><thead><tr>${HEADS.map((head) => html`<th scope="col">${head}</th>`)}</tr></thead>
    <tbody>${newest.map((row) => html`<${Row} key=${row.number} row=${row} broken=${row.number >= wrong} />`)}
    ${!newest.length && html`<tr><td colspan=${HEADS.length} class="none">No row fits.</td></tr>`}</tbody></table></div>`;
}

/** @param {{row: AuditRow, broken: boolean}} props */
function Row({ row, broken }) {
  return html`<tr class=${broken ? 'broken' : ''} title=${`${row.at_utc}, hash ${row.hash}`}>
    <th scope="row">${row.number}</th><td>${clockText(1000 * row.time_s)}</td><td>${row.author}</td>
    <td>${row.role}</td><td>${plain(row.action)}</td><td>${row.event ?? ''}</td><td>${row.subject}</td>
    <td>${row.cause}</td><td class=${row.outcome === 'done' ? '' : 'refused'}>${row.outcome}</td><td>${row.text}</td></tr>`;
}
