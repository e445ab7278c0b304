/** A slider that shows its name, its value with unit, and its range. */
import { html } from '../../vendor/preact.js';

/**
 * @param {{name: string, value: number, min: number, max: number, step: number,
 *   text: (value: number) => string, onInput: (value: number) => void, disabled?: boolean,
 *   rtl?: boolean, more?: object, hint?: string}} props
 */
export function Slider(props) {
  const { name, value, min, max, step, text, disabled = false, rtl = false, more = {} } = props;
  const id = `slider-${name.toLowerCase().replace(/\W+/g, '-')}`;
  const input = (/** @type {any} */ event) => props.onInput(Number(event.currentTarget.value));
  const ends = rtl ? [max, min] : [min, max];
  return html`<div class="slider" title=${props.hint}>
    <label for=${id}>${name}</label>
    <output for=${id} aria-live="off">${text(value)}</output>
    <input id=${id} type="range" min=${min} max=${max} step=${step} value=${value}
      dir=${rtl ? 'rtl' : 'ltr'} disabled=${disabled} aria-valuetext=${text(value)}
      onInput=${input} ...${more} />
    <span class="ends" aria-hidden="true"><span>${text(ends[0])}</span><span>${text(ends[1])}</span></span>
  </div>`;
}
