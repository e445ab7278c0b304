/** Details of a request: its header, its XML with errors marked, and the reply. */
import { html, useEffect, useState } from '../../vendor/preact.js';
import { mayDrive } from '../store.js';
import { countText, serviceText, timeText } from './request_table.js';

const HEADER = ['DestinationID', 'MessageID', 'SourceID', 'Timestamp', 'SessionID'];

/**
 * @param {{log: string, row: any}} props The row changes when the reply comes.
 */
export function MessageDetail({ log, row }) {
  const [found, setFound] = useState(/** @type {any} */ (null));
  useEffect(() => {
    let isCurrent = true;
    setFound(null);
    if (row && mayDrive.value) ask(log, row.n).then((body) => isCurrent && setFound(body));
    return () => void (isCurrent = false);
  }, [log, row?.n, row?.code, mayDrive.value]);
  return html`<section class="panel message" aria-label="Message">
    <h2>${row ? `Request ${row.n}` : 'Message'}</h2>
    ${!row && html`<p class="soft">Select a request to see its header, its XML and the reply.</p>`}
    ${row && !mayDrive.value && html`<p class="soft">Complete messages contain session numbers, which allow driving. Open the address for driving
      to see them.</p>`}
    ${found?.failed && html`<p class="wrong">${found.failed}</p>`}
    ${found?.header && html`<${Whole} found=${found} />`}
  </section>`;
}

/**
 * @param {string} log
 * @param {number} number
 */
async function ask(log, number) {
  try {
    const answer = await fetch(`/api/logs/${encodeURIComponent(log)}/${number}`);
    const body = await answer.json();
    return answer.ok ? body : { failed: body.text };
  } catch {
    return { failed: 'The server did not answer.' };
  }
}

/** @param {{found: any}} props */
function Whole({ found }) {
  const answered = found.published ? 'a publication: nobody answers' : 'no answer';
  return html`<dl class="header">
      <div><dt>Kind</dt><dd>${found.kind}</dd></div>
      ${HEADER.map((name) => html`<div><dt>${name}</dt><dd>${found.header[name] ?? 'absent'}
        ${found.labels[name] && html` <small>${found.labels[name]}</small>`}</dd></div>`)}
      <div><dt>Arrived</dt><dd>${timeText(found.t)}</dd></div>
      <div><dt>Answered in</dt><dd>${serviceText(found.service_us)}</dd></div>
    </dl>
    ${found.problems.map(
      (/** @type {any} */ one) => html`<p class="wrong">Line ${one.line}, column ${one.column}: ${one.text}</p>`,
    )}
    ${found.sent > found.bytes && html`<p class="soft">The log has the first ${countText(found.bytes)} of ${countText(found.sent)} bytes.</p>`}
    <h3>XML</h3>
    <${Source} text=${found.request} problems=${found.problems} name="XML of the request" />
    <h3>Reply</h3>
    <p class=${found.code ? 'wrong' : ''}>${found.code === null ? answered : `${found.code} ${found.word}${found.text ? `: ${found.text}` : ''}`}</p>
    ${found.reply_cut && html`<p class="soft">The log has the first ${countText(found.reply.length)} characters of it.</p>`}
    ${found.reply !== null && html`<${Source} text=${found.reply} problems=${[]} name="XML of the reply" />`}`;
}

/**
 * Lines with their numbers; those with an error are marked.
 * @param {{text: string, problems: {line: number, column: number}[], name: string}} props
 */
function Source({ text, problems, name }) {
  const wrong = new Map(problems.map((one) => [one.line, one.column]));
  return html`<pre class="source" tabindex="0" role="group" aria-label=${name}>${text.split('\n').map((line, index) => {
    const column = wrong.get(index + 1);
    const [before, after] = column ? [line.slice(0, column - 1), line.slice(column - 1)] : [line, ''];
    return html`<span class=${column ? 'code bad' : 'code'}>${before}${after && html`<mark>${after}</mark>`}${'\n'}</span>`;
  })}</pre>`;
}
