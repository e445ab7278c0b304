/** Head of the list of events: the person's name, who decides, and the button that raises an event. */
import { html } from '../../vendor/preact.js';
import { allowed, control, isDispatcher, mayDispatch, maySupervise, you } from '../store.js';
import { act } from '../net/actions.js';
import { Choice, Field } from '../ui/fields.js';
import { mode, onShift, ownName, ownRoom, raising, rename } from './shared.js';

const MODES = /** @type {[string, string][]} */ ([
  ['automatic', 'the policy, by itself'],
  ['ask_first', 'people: the policy asks first'],
]);

const byDva = () => `The DVA lets this console ${allowed.value}.`;
const byAddress = () => `This address may ${you.value?.role ?? 'look'}. Those for dispatch and for
  supervision are printed where the console was started.`;

/** Show one of the two in place of the event in hand, or neither. @param {typeof raising} what */
function show(what) {
  const isShown = what.value;
  for (const one of [onShift, raising]) one.value = one === what && !isShown;
}

/** @param {{join: () => void}} props */
export function DeskHead({ join }) {
  if (!mayDispatch.value) return html`<p class="soft">${isDispatcher.value ? byDva() : byAddress()}</p>`;
  const asked = control.value?.dispatch;
  const decides = asked ? `, ${mode.value === 'ask_first' ? 'people decide' : 'the policy decides'}` : '';
  return html`<div class="desk-head">
    <details><summary>${ownRoom.value || 'You'}${decides}</summary>
      <section class="panel" aria-label="You">
        ${you.value?.user ? html`<p>The log shows you as ${you.value.user}.</p>` : html`
        <${Field} name="Your name" value=${ownName.value} onInput=${rename}
          hint=${ownRoom.value ? `The log shows you as ${ownRoom.value}` : 'As shown in the log'} />
        <button type="button" onClick=${join}>Use this name</button>`}
        ${asked && html`<${Choice} name="Who decides" value=${mode.value} options=${MODES}
          disabled=${!maySupervise.value} onInput=${(/** @type {string} */ to) => act('dispatch_mode', { mode: to })} />`}
        ${asked?.switched && html`<small class="soft">set by ${asked.switched.label}</small>`}
      </section></details>
    <button type="button" aria-pressed=${onShift.value} onClick=${() => show(onShift)}>Shift</button>
    <button type="button" aria-pressed=${raising.value} onClick=${() => show(raising)}>Raise an event</button>
  </div>`;
}
