/** Filters of the requests by device, kind, reply and text; and actions on the list. */
import { html } from '../../vendor/preact.js';
import { isAttached, mayDrive } from '../store.js';
import { Choice, Field, Tick } from '../ui/fields.js';

const CODES = /** @type {[string, string][]} */ ([
  ['', 'all'], ['0', 'ok'], ['refused', 'refused'], ['none', 'no answer'],
]);

/** @typedef {{device: string, kind: string, code: string, text: string, without: string,
 *   publications: boolean, renewals: boolean, since: number}} LogFilter */

/** @type {LogFilter} */
export const ALL = { device: '', kind: '', code: '', text: '', without: '', publications: false, renewals: false, since: 0 };

/** @param {LogFilter} filter */
export const isNarrow = (filter) =>
  Boolean(filter.device || filter.kind || filter.code || filter.text);

/**
 * @param {{filter: LogFilter, kinds: string[], onFilter: (more: Partial<LogFilter>) => void,
 *   isPaused: boolean, onPause: () => void, onClear: () => void, exported: string, own: boolean, onOwn: (own: boolean) => void}} props
 */
export function RequestFilters({ filter, kinds, own, onOwn, onFilter, isPaused, onPause, onClear, exported }) {
  const options = /** @type {[string, string][]} */ ([
    ['', 'all'], ...[...new Set([...kinds, filter.kind])].filter(Boolean).sort().map((kind) => [kind, kind]),
  ]);
  return html`<div class="filters" role="search" aria-label="Requests shown">
    <${Field} name="Device" value=${filter.device} onInput=${(/** @type {string} */ device) => onFilter({ device })} />
    <${Choice} name="Kind" value=${filter.kind} options=${options} onInput=${(/** @type {string} */ kind) => onFilter({ kind })} />
    <${Choice} name="Code" value=${filter.code} options=${CODES} onInput=${(/** @type {string} */ code) => onFilter({ code })} />
    ${mayDrive.value && html`<${Field} name="Search" value=${filter.text} onInput=${(/** @type {string} */ text) => onFilter({ text })} />`}
    <${Tick} name="Renewals" value=${filter.renewals} onInput=${(/** @type {boolean} */ renewals) => onFilter({ renewals })} />
    ${isAttached.value
      ? html`<${Tick} name="This console's" value=${own} onInput=${onOwn} />`
      : html`<${Tick} name="Publications" value=${filter.publications} onInput=${(/** @type {boolean} */ publications) => onFilter({ publications })} />`}
    <div class="buttons">
      <button type="button" aria-pressed=${isPaused} onClick=${onPause}>${isPaused ? 'Resume log' : 'Pause log'}</button>
      <button type="button" onClick=${onClear}>Clear log</button>
      ${mayDrive.value && html`<a class="button" href=${exported} download>Export</a>`}
    </div>
  </div>`;
}
