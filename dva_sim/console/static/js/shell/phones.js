/** Address for phones, as a code to scan; available only to operators. */
import { html, signal, useEffect, useRef } from '../../vendor/preact.js';
import { isOperator } from '../store.js';
import { Icon } from '../ui/icon.js';

const address = signal('');
const open = signal(false);

/** Button that opens the code; shown if there is an address for phones. */
export function PhoneButton() {
  const own = isOperator.value;
  useEffect(() => {
    if (own) ask();
  }, [own]);
  if (!address.value) return null;
  return html`<button type="button" class="phone-button" onClick=${() => (open.value = true)}>
    <svg class="icon" viewBox="0 0 24 24" aria-hidden="true" focusable="false" fill="none"
      stroke="currentColor" stroke-width="2" stroke-linejoin="round">
      <path d="M7 2h10v20H7zM11 18.5h2" /></svg>Phone</button>`;
}

async function ask() {
  try {
    const answer = await fetch('/api/phones');
    address.value = answer.ok ? ((await answer.json()).address ?? '') : '';
  } catch {
    address.value = ''; // asked again with the next connection
  }
}

/** The code, hidden until somebody opens it: anyone who sees it may drive. */
export function PhoneCode() {
  const dialog = useRef(/** @type {HTMLDialogElement | null} */ (null));
  useEffect(() => {
    if (open.value && !dialog.current?.open) dialog.current?.showModal();
    if (!open.value) dialog.current?.close();
  }, [open.value]);
  return html`<dialog class="help phone-code" ref=${dialog} aria-labelledby="phone-title"
    onClose=${() => (open.value = false)}>
    <button type="button" class="close" aria-label="Close" onClick=${() => (open.value = false)}>
      <${Icon} name="x" /></button>
    <h2 id="phone-title">Drive by phone</h2>
    ${open.value && html`<img src="/api/phones.svg" width="264" height="264" alt="QR code of the address for phones" />`}
    <p>Scan the code, or open <code>${address.value}</code> on the phone.</p>
    <p>Each phone must trust this computer once: <a href="/trust" target="_blank">how to trust it</a>.</p>
  </dialog>`;
}
