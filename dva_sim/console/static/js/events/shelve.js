/** Form that takes an alarm out of the list: for how long, and why. */
import { html, useState } from '../../vendor/preact.js';
import { maySteer } from '../store.js';
import { act } from '../net/actions.js';
import { Choice, Field } from '../ui/fields.js';

const LENGTHS = /** @type {[string, string][]} */ ([
  ['300', '5 minutes'], ['900', '15 minutes'], ['3600', '1 hour'], ['28800', 'a shift, 8 hours'],
]);

/** True for an alarm that has to be acknowledged first. @param {import('../lines.js').AlarmRow} alarm */
const isUnseenCritical = (alarm) => alarm.priority === 'critical' && alarm.state === 'unacknowledged';

/** Button, and the form that it opens. @param {{alarm: import('../lines.js').AlarmRow}} props */
export function Shelve({ alarm }) {
  const [isOpen, setOpen] = useState(false);
  const [length, setLength] = useState('900');
  const [why, setWhy] = useState('');
  const isBarred = isUnseenCritical(alarm);
  const shelve = async () => {
    const done = await act('alarm_shelve', { alarm: alarm.key, for_s: Number(length), reason: why.trim() });
    if (done.ok) setOpen(false);
  };
  if (!isOpen) {
    return html`<button type="button" disabled=${!maySteer.value || isBarred} onClick=${() => setOpen(true)}
      title=${isBarred ? 'Acknowledge it first: it is critical' : 'Hide it for a while'}
      aria-label=${`Shelve: ${alarm.text}`}>Shelve</button>`;
  }
  return html`<div class="shelve" role="group" aria-label="Shelve">
    <${Choice} name="For how long" value=${length} options=${LENGTHS} onInput=${setLength} />
    <${Field} name="Why" value=${why} most=${256} onInput=${setWhy} />
    <div class="buttons"><button type="button" disabled=${!why.trim()} onClick=${shelve}>Shelve it</button>
      <button type="button" class="plain" onClick=${() => setOpen(false)}>Cancel</button></div></div>`;
}
