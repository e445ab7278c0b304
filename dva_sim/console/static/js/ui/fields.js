/** Labelled form fields with their error messages. */
import { html } from '../../vendor/preact.js';

/**
 * Field for text or a number.
 * @param {{name: string, value: string, onInput: (text: string) => void, wrong?: string,
 *   mode?: string, disabled?: boolean, hint?: string, most?: number}} props
 */
export function Field({ name, value, onInput, wrong = '', mode = 'text', disabled, hint, most = 64 }) {
  const id = idOf(name);
  const about = [hint && `${id}-hint`, wrong && `${id}-wrong`].filter(Boolean).join(' ');
  return html`<div class="field">
    <label for=${id}>${name}</label>
    <input id=${id} type="text" inputmode=${mode} value=${value} maxlength=${most} disabled=${disabled}
      autocomplete="off" autocapitalize="off" spellcheck=${false}
      aria-invalid=${wrong ? 'true' : null} aria-describedby=${about || null}
      onInput=${(/** @type {any} */ event) => onInput(event.currentTarget.value)} />
    ${hint && html`<small id=${`${id}-hint`}>${hint}</small>`}
    ${wrong && html`<p class="wrong" id=${`${id}-wrong`}>${wrong}</p>`}
  </div>`;
}

/**
 * Selection from a list of options.
 * @param {{name: string, value: string, options: [string, string][],
 *   onInput: (value: string) => void, disabled?: boolean, wrong?: string}} props
 */
export function Choice({ name, value, options, onInput, disabled, wrong = '' }) {
  const id = idOf(name);
  return html`<div class="field">
    <label for=${id}>${name}</label>
    <select id=${id} value=${value} disabled=${disabled} aria-invalid=${wrong ? 'true' : null}
      aria-describedby=${wrong ? `${id}-wrong` : null}
      onInput=${(/** @type {any} */ event) => onInput(event.currentTarget.value)}>
      ${options.map(([key, text]) => html`<option key=${key} value=${key} selected=${key === value}>${text}</option>`)}
    </select>
    ${wrong && html`<p class="wrong" id=${`${id}-wrong`}>${wrong}</p>`}
  </div>`;
}

/**
 * Labelled checkbox.
 * @param {{name: string, value: boolean, onInput: (value: boolean) => void}} props
 */
export function Tick({ name, value, onInput }) {
  return html`<label class="tick"><input type="checkbox" checked=${value}
    onInput=${(/** @type {any} */ event) => onInput(event.currentTarget.checked)} /> ${name}</label>`;
}

/** @param {string} name */
const idOf = (name) => `field-${name.toLowerCase().replace(/\W+/g, '-')}`;

/**
 * Error message for a number; empty if the number is valid.
 * @param {string} text
 * @param {number} low
 * @param {number} high
 * @param {string} unit
 */
export function wrongNumber(text, low, high, unit) {
  const value = Number(text.replace(',', '.'));
  if (text.trim() && value >= low && value <= high) return '';
  return `Enter a number from ${low} to ${high} ${unit}.`;
}
