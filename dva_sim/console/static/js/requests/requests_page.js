/** What did the DVA hear, and what did it answer? */
import { html, useState } from '../../vendor/preact.js';
import { useLog } from '../logs/looking.js';
import { RequestTable } from './request_table.js';

/** The page. */
export function RequestsPage() {
  const rows = useLog('dva');
  const [chosen, choose] = useState(/** @type {number | null} */ (null));
  return html`<main class="page requests-page" id="main" tabindex="-1">
    <h1 class="hidden">Main</h1>
    <section class="panel requests" aria-label="Log">
      <${RequestTable} rows=${rows} chosen=${chosen} onChoose=${choose} />
    </section>
  </main>`;
}
