/** Story page: reports and marks of a recording, one per line; each jumps to its moment. */
import { html } from '../../vendor/preact.js';
import { replay, story } from '../store.js';
import { act } from '../net/actions.js';
import { clockText } from '../ui/words.js';

/** The page. */
export function StoryPage() {
  const lines = story.value;
  const last = lines.at(-1)?.t ?? -1;
  const later = (replay.value?.marks ?? []).filter((mark) => mark.t > last);
  return html`<main class="page story-page" id="main" tabindex="-1">
    <h1>Story</h1>
    <p class="soft">Select a line to jump to that moment.</p>
    <h2>Story so far</h2>
    <${Lines} name="Story so far" lines=${lines} />
    <h2>Still to come</h2>
    <${Lines} name="Still to come" lines=${later} />
  </main>`;
}

/** @param {{name: string, lines: {t: number, who: string, what: string}[]}} props */
function Lines({ name, lines }) {
  if (!lines.length) return html`<p class="none">Nothing.</p>`;
  return html`<ol class="rows story" aria-label=${name}>${lines.map(
    (line) => html`<li><button type="button" class="row" onClick=${() => act('seek', { t_ms: line.t })}>
      <span class="figure">${clockText(line.t)}</span>
      <span><span class="soft">${line.who}</span> ${line.what}</span></button></li>`,
  )}</ol>`;
}
