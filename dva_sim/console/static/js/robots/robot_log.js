/** All teleoperation messages that a robot receives, in order, with its replies. */
import { html, useEffect, useRef, useState } from '../../vendor/preact.js';
import { useLog } from '../logs/looking.js';
import { countText, replyText, serviceText, timeText } from '../requests/request_table.js';
import { Tick } from '../ui/fields.js';
import { latencyText } from './robot_latency.js';
import { windowOf } from './window.js';

const TELEOPERATION = ['StartTeleOp', 'SetTeleOp', 'StopTeleOp', 'EmergencyMsg'];
const NEAR_PX = 40;
const SHOWN = 300;

/** @param {{robot: import('../lines.js').Thing}} props */
export function RobotLog({ robot }) {
  const [all, showAll] = useState(false);
  const rows = useLog(robot.label, { publications: true });
  const shown = rows.filter((row) => row.gap || all || TELEOPERATION.includes(row.kind)).slice(-SHOWN);
  const box = useRef(/** @type {HTMLDivElement | null} */ (null));
  const atEnd = useRef(true);
  useEffect(() => {
    if (atEnd.current && box.current) box.current.scrollTop = box.current.scrollHeight;
  }, [shown]);
  const onScroll = (/** @type {Event} */ event) => {
    // Not the ref: the last scroll event may arrive after the page was left.
    const { scrollTop, scrollHeight, clientHeight } = /** @type {HTMLDivElement} */ (event.target);
    atEnd.current = scrollHeight - scrollTop - clientHeight < NEAR_PX;
  };
  return html`<section class="panel robot-log" aria-label="Log">
    <h2>Log <span class="count reported">${latencyText(windowOf(robot.i))}</span></h2>
    <div class="scrolls log" ref=${box} onScroll=${onScroll} tabindex="0" role="group" aria-label="Messages, scrolls">
      <table aria-label="Messages"><thead><tr>${['Time', 'Message', 'From', 'Reply'].map((head) => html`<th scope="col">${head}</th>`)}</tr></thead>
      <tbody>${shown.map((row) => (row.gap ? gap(row) : html`<${Row} key=${row.n} row=${row} />`))}</tbody></table>
      ${!shown.length && html`<p class="soft empty">No teleoperation message has arrived yet.</p>`}
    </div>
    <${Tick} name="Show other messages as well" value=${all} onInput=${showAll} />
  </section>`;
}

/** @param {any} row */
const gap = (row) => html`<tr key=${row.n} class="gap"><td colspan="4">${countText(row.gap)} not shown</td></tr>`;

/** @param {{row: any}} props */
function Row({ row }) {
  const refused = row.code !== null && row.code !== 0;
  return html`<tr class=${refused ? 'refused' : ''}>
    <td class="n">${timeText(row.t)}</td>
    <td class="payload">${row.kind} <small>${row.payload}</small></td>
    <td>${row.from_label || row.from || '–'}</td>
    <td>${row.published ? 'none: published' : replyText(row)} <small>${row.code === null ? '' : serviceText(row.service_us)}</small></td>
  </tr>`;
}
