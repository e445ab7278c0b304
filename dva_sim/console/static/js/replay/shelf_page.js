/** Recordings of a study, worst first, and its report. */
import { html } from '../../vendor/preact.js';
import { maySteerReplay, replay, shelf } from '../store.js';
import { act } from '../net/actions.js';

/** @typedef {import('../lines.js').ShelfEntry} ShelfEntry */

/** The page. */
export function ShelfPage() {
  const about = shelf.value;
  if (!about) return null;
  const order = about.worst_by ? `the worst by ${about.worst_by} first` : 'by name';
  return html`<main class="page shelf-page" id="main" tabindex="-1">
    <h1>Recordings</h1>
    <p>${about.question || about.folder}</p>
    <p class="soft">${about.recordings.length} recordings, ${order}.
      ${about.report ? html` <a href="/report" target="_blank" rel="noopener">Report of the study</a>` : null}</p>
    <div class="scroll" tabindex="0" role="region" aria-label="Table of recordings"><table aria-label="Recordings">
      <thead><tr><th scope="col">Recording</th>
        ${about.factors.map((factor) => html`<th scope="col">${factor}</th>`)}
        ${about.measures.map((one) => html`<th scope="col">${one.title}${one.unit ? ` [${one.unit}]` : ''}</th>`)}</tr></thead>
      <tbody>${about.recordings.map((one) => html`<${Row} key=${one.name} one=${one} />`)}</tbody>
    </table></div>
  </main>`;
}

let isOpening = false;

/**
 * Open a recording, once, and go to the map, unless the person has gone elsewhere meanwhile.
 * @param {string} name
 */
async function open(name) {
  if (isOpening) return;
  isOpening = true;
  const before = location.hash;
  const answer = await act('open_recording', { name });
  isOpening = false;
  if (answer.ok && location.hash === before) location.hash = '#/map';
}

/** @param {{one: ShelfEntry}} props */
function Row({ one }) {
  const current = replay.value?.name === one.name;
  return html`<tr aria-current=${current ? 'true' : null}>
    <th scope="row"><button type="button" disabled=${!maySteerReplay.value}
      onClick=${() => open(one.name)}>${one.name}</button></th>
    ${one.levels.map((level) => html`<td>${text(level)}</td>`)}
    ${one.values.map((value) => html`<td class="figure">${text(value)}</td>`)}
  </tr>`;
}

/** @param {unknown} value */
const text = (value) => (value === null || value === undefined ? 'never' : String(value));
