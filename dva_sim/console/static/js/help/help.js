/** Help dialog. */
import { html, signal, useEffect, useRef } from '../../vendor/preact.js';
import { Icon } from '../ui/icon.js';
import { KEYS, TEXTS } from './texts.js';

const open = signal(false);

/** Open the help dialog. */
export const openHelp = () => (open.value = true);

/** The dialog, closed until somebody opens it. */
export function Help() {
  const dialog = useRef(/** @type {HTMLDialogElement | null} */ (null));
  useEffect(() => {
    if (open.value && !dialog.current?.open) dialog.current?.showModal();
    if (!open.value) dialog.current?.close();
  }, [open.value]);
  return html`<dialog class="help" ref=${dialog} aria-labelledby="help-title" onClose=${() => (open.value = false)}>
    <button type="button" class="close" aria-label="Close" onClick=${() => (open.value = false)}>
      <${Icon} name="x" /></button>
    <h2 id="help-title">Help</h2>
    ${TEXTS.map(
      ({ title, lines }) => html`<h3>${title}</h3><ul>${lines.map((line) => html`<li>${line}</li>`)}</ul>`,
    )}
    <h3>Keys</h3>
    <table><tbody>${KEYS.map(([key, what]) => html`<tr><th scope="row"><kbd>${key}</kbd></th><td>${what}</td></tr>`)}</tbody></table>
  </dialog>`;
}
