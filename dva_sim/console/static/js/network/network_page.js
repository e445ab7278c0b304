/** Network page: the settings of the link, and their effect on each robot's commands. */
import { html } from '../../vendor/preact.js';
import { driveOf, modeOf, robots, rowOf, rows } from '../store.js';
import { Chart } from '../charts/chart.js';
import { driven } from '../shell/route.js';
import { ModeMark } from '../ui/icon.js';
import { isNumber, msText } from '../ui/words.js';
import { LinkPanel } from './link_panel.js';
import { MarkMoment } from './mark_moment.js';
import { PatternSelect } from './pattern_select.js';
import { KINDS, SPAN_S, read } from './samples.js';

const MAX_LINES = 4;
const MAX_ROWS = 50;
const DASHES = [undefined, [6, 3], [2, 3], [10, 3, 2, 3]];

/** @typedef {import('../lines.js').Thing} Thing */

/** The page. */
export function NetworkPage() {
  return html`<main class="page network-page" id="main" tabindex="-1">
    <h1 class="hidden">Network</h1>
    <${LinkPanel} />
    <${MarkMoment} />
    <${Figures} />
    <${Charts} />
  </main>`;
}

/** The robots on the page for driving first, then the others. */
function inOrder() {
  const first = driven.value;
  return [...first, ...robots.value.filter((robot) => !first.includes(robot))];
}

function Figures() {
  void rows.value;
  const list = inOrder();
  const heads = ['Robot', 'Mode', 'Pattern', 'Commands', 'Waiting', 'Lost', 'Refused', 'Command age', 'Round trip'];
  const units = ['', '', '', '1/s', '', '', '', 'ms', 'ms'];
  return html`<section class="panel figures-panel" aria-label="Figures">
    <h2>Each robot <span class="count">${rows.value?.dropped ?? 0} messages to the pages given up</span></h2>
    <div class="scrolls" tabindex="0" role="group" aria-label="Table, scrolls sideways"><table><thead><tr>
      ${heads.map((head, n) => html`<th scope="col">${head}${units[n] && html`<small> ${units[n]}</small>`}</th>`)}
    </tr></thead><tbody class="reported">
      ${list.slice(0, MAX_ROWS).map((robot) => html`<${Row} key=${robot.i} robot=${robot} />`)}
    </tbody></table></div>
    ${list.length > MAX_ROWS && html`<p class="soft">and ${list.length - MAX_ROWS} more robots</p>`}
  </section>`;
}

/** @param {{robot: Thing}} props */
function Row({ robot }) {
  const row = rowOf(robot.i);
  const drive = driveOf(robot.i);
  const number = (/** @type {number | null | undefined} */ value, digits = 0) =>
    isNumber(value) ? /** @type {number} */ (value).toFixed(digits) : '–';
  return html`<tr>
    <th scope="row">${robot.label}</th>
    <td><${ModeMark} mode=${modeOf(robot.i)} /> ${modeOf(robot.i)}</td>
    <td><${PatternSelect} robot=${robot} /></td>
    <td class="n">${number(row?.commands_hz, 1)}</td><td class="n">${number(row?.queue)}</td>
    <td class="n">${number(row?.lost)}</td><td class="n">${number(row?.refused)}</td>
    <td class="n">${msText(drive?.command_age_ms)}</td><td class="n">${msText(drive?.round_trip_ms)}</td>
  </tr>`;
}

function Charts() {
  const shown = inOrder().slice(0, MAX_LINES);
  const numbers = shown.map((robot) => robot.i);
  void rows.value;
  const lines = shown.map((robot, n) => ({
    label: robot.label,
    colour: `pattern-${rowOf(robot.i)?.pattern}`,
    dash: DASHES[n],
  }));
  return html`<section class="panel reported" aria-label="Charts">
    <h2>On one time axis <span class="count">the last ${SPAN_S} s of the world's time</span></h2>
    <p class="figures">${shown.map(
      (robot, n) => html`<span><i class=${`line line-${n} ${lines[n].colour}`}></i>${robot.label}</span>`,
    )}</p>
    ${KINDS.map(
      (kind, n) => html`<${Chart} title=${kind.title} unit=${kind.unit} lines=${lines} span=${SPAN_S}
        least=${kind.least} sync="network" read=${() => read(n, numbers)} />`,
    )}
  </section>`;
}
