/** All robots, each with a link to its page; or the page of the robot named in the address. */
import { html } from '../../vendor/preact.js';
import { modeOf, robots, rowOf, rows, scene } from '../store.js';
import { detail } from '../shell/route.js';
import { ModeMark } from '../ui/icon.js';
import { percentText } from '../ui/words.js';
import { RobotPage } from './robot_page.js';

const HEADS = ['Robot', 'Mode', 'Holder', 'Speed', 'Battery', 'Why it is stopped'];

/** The page. */
export function RobotsPage() {
  const name = detail.value;
  const only = scene.value?.pages && robots.value.length === 1;
  if (!name && !only) return html`<${List} />`;
  const robot = robots.value.find((one) => !name || one.label === name || one.id === name);
  return robot ? html`<${RobotPage} key=${robot.i} robot=${robot} />` : html`<${Nobody} name=${name} />`;
}

/** @param {string} label */
export const robotAddress = (label) => `#/robots/${encodeURIComponent(label)}`;

/** @param {{name: string}} props */
function Nobody({ name }) {
  return html`<main class="page robots-page" id="main" tabindex="-1"><h1>Robots</h1>
    <p>There is no robot ${name} in this run. <a href="#/robots">All robots</a></p></main>`;
}

function List() {
  void rows.value;
  return html`<main class="page robots-page" id="main" tabindex="-1"><h1>Robots</h1>
    <div class="scrolls panel" tabindex="0" role="group" aria-label="Table, scrolls sideways">
      <table aria-label="Robots"><thead><tr>${HEADS.map((head) => html`<th scope="col">${head}</th>`)}</tr></thead>
      <tbody class="reported">${robots.value.map((robot) => html`<${Row} key=${robot.i} robot=${robot} />`)}</tbody></table>
    </div></main>`;
}

/** @param {{robot: import('../lines.js').Thing}} props */
function Row({ robot }) {
  const row = rowOf(robot.i);
  const mode = modeOf(robot.i);
  return html`<tr>
    <th scope="row"><a href=${robotAddress(robot.label)}>${robot.label}</a></th>
    <td><${ModeMark} mode=${mode} /> ${mode}</td>
    <td>${row?.holder_label ?? row?.holder ?? '–'}</td>
    <td class="n">${(row?.set_speed_mps ?? 0).toFixed(2)} m/s</td>
    <td class="n">${percentText(row?.battery)}</td>
    <td class="soft">${row?.stop_reason ?? ''}</td></tr>`;
}
