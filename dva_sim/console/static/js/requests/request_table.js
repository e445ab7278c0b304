/** All requests in the order of arrival, one line each; a gap says how many are not shown. */
import { html, useEffect, useRef } from '../../vendor/preact.js';
import { clockText } from '../ui/words.js';

const HEADS = ['No.', 'Time', 'Kind', 'From', 'Reply', 'Service', 'Payload', 'Session', 'To'];
const NEAR_PX = 40;

/**
 * @param {{rows: any[], chosen: number | null, onChoose: (number: number) => void,
 *   older?: any}} props
 */
export function RequestTable({ rows, chosen, onChoose, older }) {
  const box = useRef(/** @type {HTMLDivElement | null} */ (null));
  const atEnd = useRef(true);
  useEffect(() => {
    if (atEnd.current && box.current) box.current.scrollTop = box.current.scrollHeight;
  }, [rows]);
  const onScroll = (/** @type {Event} */ event) => {
    // Not the ref: the last scroll event may arrive after the page was left.
    const { scrollTop, scrollHeight, clientHeight } = /** @type {HTMLDivElement} */ (event.target);
    atEnd.current = scrollHeight - scrollTop - clientHeight < NEAR_PX;
  };
  const reachable = rows.some((row) => row.n === chosen)
    ? chosen
    : rows.filter((row) => !row.gap).at(-1)?.n;
  return html`<div class="scrolls log" ref=${box} onScroll=${onScroll} tabindex="0" role="group"
      aria-label="Log, scrolls">
    ${older}
    <table aria-label="Requests">
      <thead><tr>${HEADS.map((head) => html`<th scope="col">${head}</th>`)}</tr></thead>
      <tbody onKeyDown=${move}>${rows.map((row) =>
        row.gap
          ? html`<tr key=${row.n} class="gap"><td colspan=${HEADS.length}>${countText(row.gap)} not shown</td></tr>`
          : html`<${Row} key=${row.n} row=${row} isChosen=${row.n === chosen}
              isReachable=${row.n === reachable} onChoose=${onChoose} />`,
      )}</tbody>
    </table>
    ${!rows.length && html`<p class="soft empty">No request yet.</p>`}
  </div>`;
}

/** @param {number} count */
export const countText = (count) => count.toLocaleString('en-US');

/**
 * @param {{row: any, isChosen: boolean, isReachable: boolean,
 *   onChoose: (number: number) => void}} props
 */
function Row({ row, isChosen, isReachable, onChoose }) {
  const refused = row.code !== null && row.code !== 0;
  const look = [refused && 'refused', row.published && 'published', isChosen && 'chosen'];
  return html`<tr class=${look.filter(Boolean).join(' ')} onClick=${() => onChoose(row.n)}>
    <td class="n"><button type="button" class="plain number" tabindex=${isReachable ? 0 : -1}
      aria-pressed=${isChosen} aria-label=${`Request ${row.n}`}>${row.n}</button></td>
    <td class="n">${timeText(row.t)}</td>
    <td>${row.kind}</td>
    <td class="end"><${End} label=${row.from_label} id=${row.from} /></td>
    <td class="reply">${replyText(row)}</td>
    <td class="n">${serviceText(row.service_us)}</td>
    <td class="payload">${row.payload}</td>
    <td class="n">${row.session || '–'}</td>
    <td class="end"><${End} label=${row.to_label} id=${row.to} /></td>
  </tr>`;
}

/** @param {{label: string, id: string}} props */
function End({ label, id }) {
  if (!label && !id) return '–';
  return html`${label} <small>${id}</small>`;
}

/** @param {any} row */
export function replyText(row) {
  if (row.published) return 'published';
  if (row.code === null) return 'no answer';
  const words = row.text ? `: ${row.text}` : '';
  return `${row.code} ${row.word}${words}`;
}

/** @param {number} ms negative before the page's own start */
export function timeText(ms) {
  const since = Math.abs(ms);
  return `${ms < 0 ? '−' : ''}${clockText(since)}.${String(Math.floor(since % 1000)).padStart(3, '0')}`;
}

/** @param {number | null} us */
export function serviceText(us) {
  if (us === null) return '–';
  return us < 100_000 ? `${(us / 1000).toFixed(us < 10_000 ? 2 : 1)} ms` : `${(us / 1e6).toFixed(2)} s`;
}

/**
 * Move from line to line with the arrow keys.
 * @param {KeyboardEvent} event
 */
function move(event) {
  const step = { ArrowDown: 'nextElementSibling', ArrowUp: 'previousElementSibling' }[event.key];
  if (!step || !(event.target instanceof Element)) return;
  event.preventDefault();
  let row = /** @type {any} */ (event.target.closest('tr'))?.[step];
  while (row?.classList.contains('gap')) row = row[step];
  row?.querySelector('button')?.focus();
}
