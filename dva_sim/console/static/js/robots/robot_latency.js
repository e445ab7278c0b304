/** Latency of the messages between a robot and its driver. */
import { html, useEffect, useMemo, useRef } from '../../vendor/preact.js';
import { rowOf } from '../store.js';
import { isStale, worldNow } from '../net/world_time.js';
import { Chart } from '../charts/chart.js';
import { History } from '../charts/history.js';
import { msText } from '../ui/words.js';
import { windowOf } from './window.js';

const SAMPLE_MS = 250;

/** @typedef {import('../lines.js').RobotWindow} RobotWindow */

const KINDS = /** @type {[keyof RobotWindow, string, string][]} */ ([
  ['one_way', 'Client to robot', 'one way, only for drivers in this program; other clocks differ'],
  ['loop', 'Robot, client, robot', 'by the robot’s own clock: from a picture to the command it led to'],
  ['replies', 'Request to reply', 'in the robot'],
]);
const FIGURES = /** @type {[string, string][]} */ ([['last_ms', 'Last'], ['median_ms', 'Median'], ['p95_ms', 'p95'], ['largest_ms', 'Largest']]);

/** One-way figures if available, else the first available kind. @param {RobotWindow | undefined} shown */
function best(shown) {
  const kind = KINDS.find(([key]) => shown?.[key]);
  return kind && { name: kind[1], figures: /** @type {any} */ (shown?.[kind[0]]) };
}

/** Latency text for the header of the log. @param {RobotWindow | undefined} shown */
export function latencyText(shown) {
  const found = best(shown);
  if (!found) return 'latency: nothing heard yet';
  const { last_ms: last, median_ms: median, p95_ms: p95, largest_ms: largest } = found.figures;
  return `${found.name.toLowerCase()}: last ${msText(last)}, median ${msText(median)}, p95 ${msText(p95)}, largest ${msText(largest)}`;
}

/** @param {{robot: import('../lines.js').Thing}} props */
export function RobotLatency({ robot }) {
  const shown = windowOf(robot.i);
  const history = useMemo(() => new History(KINDS.length, 70), [robot.i]);
  const counts = useRef(/** @type {number[]} */ ([]));
  useEffect(() => {
    const timer = window.setInterval(() => sample(history, counts.current, windowOf(robot.i)), SAMPLE_MS);
    return () => window.clearInterval(timer);
  }, [history]);
  const colour = `pattern-${rowOf(robot.i)?.pattern ?? 'req-rep'}`;
  const lines = KINDS.map(([, label], n) => ({ label, colour, dash: [undefined, [6, 3], [2, 3]][n] }));
  return html`<section class="panel latency-panel reported" aria-label="Latency"><h2>Latency <span class="count">of the newest 1,000 messages</span></h2>
    <div class="scrolls" tabindex="0" role="group" aria-label="Figures, scroll sideways"><table aria-label="Latency"><thead><tr><th scope="col">ms</th>${FIGURES.map(([, name]) => html`<th scope="col">${name}</th>`)}</tr></thead>
      <tbody>${KINDS.map(([key, name, hint], n) => html`<tr title=${hint}><th scope="row"><i class=${`line line-${n} ${colour}`}></i>${name}</th>
        ${FIGURES.map(([figure]) => html`<td class="n">${figureText(shown, key, figure)}</td>`)}</tr>`)}</tbody></table></div>
    <${Chart} title="Newest message" unit="ms" lines=${lines} span=${60} least=${50} read=${() => history.read()} />
  </section>`;
}

/** @param {RobotWindow | undefined} shown @param {keyof RobotWindow} key @param {string} figure */
function figureText(shown, key, figure) {
  const value = /** @type {any} */ (shown?.[key])?.[figure];
  return value === undefined ? '–' : value.toFixed(value < 10 ? 1 : 0);
}

/**
 * Record the newest value of each kind, if it is newer than the last one recorded.
 * @param {History} history @param {number[]} counts @param {RobotWindow | undefined} shown
 */
function sample(history, counts, shown) {
  if (document.hidden || isStale.peek()) return;
  const values = KINDS.map(([key], n) => {
    const figures = /** @type {any} */ (shown?.[key]);
    const isNew = figures && figures.count !== counts[n];
    counts[n] = figures?.count ?? 0;
    return isNew ? figures.last_ms : null;
  });
  history.add(worldNow() / 1000, values);
}
