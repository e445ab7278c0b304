/** Form for a fake device: listed like all others, but it never replies. */
import { html, useState } from '../../vendor/preact.js';
import { act } from '../net/actions.js';
import { Choice, Field } from '../ui/fields.js';

const TYPES = /** @type {[string, string][]} */ (['Robot', 'Guard', 'TeleOp', 'Remote Control'].map((name) => [name, name]));
const ID = /^[0-9A-Fa-f]{2}(:[0-9A-Fa-f]{2}){5}$/;

/** @param {{onDone: () => void}} props */
export function FakeForm({ onDone }) {
  const [device, setDevice] = useState({ label: '', type: 'Robot', address: '', id_tag: '' });
  const [wrong, setWrong] = useState(/** @type {Record<string, string>} */ ({}));
  const set = (/** @type {object} */ more) => setDevice({ ...device, ...more });
  const add = async (/** @type {Event} */ event) => {
    event.preventDefault();
    const found = mistakes(device);
    setWrong(found);
    if (Object.keys(found).length) return;
    if ((await act('fake_add', device)).ok) onDone();
  };
  return html`<form class="fake-form" aria-label="Fake device" onSubmit=${add} noValidate>
    <${Field} name="Label" value=${device.label} wrong=${wrong.label} onInput=${(/** @type {string} */ label) => set({ label })} />
    <${Choice} name="Type" value=${device.type} options=${TYPES} onInput=${(/** @type {string} */ type) => set({ type })} />
    <${Field} name="Address" value=${device.address} hint="if empty: an address that nobody uses" onInput=${(/** @type {string} */ address) => set({ address })} />
    <${Field} name="Id" value=${device.id_tag} wrong=${wrong.id} most=${17} hint="left empty: the next free one" onInput=${(/** @type {string} */ id) => set({ id_tag: id })} />
    <div class="buttons"><button type="submit" class="go">Add</button>
      <button type="button" onClick=${onDone}>Cancel</button></div>
    <p class="soft">It registers like any other device but never replies, so requests to it time out.</p>
  </form>`;
}

/** @param {{label: string, id_tag: string}} device */
function mistakes({ label, id_tag: id }) {
  /** @type {Record<string, string>} */
  const found = {};
  if (!label.trim()) found.label = 'A label is needed.';
  if (id.trim() && !ID.test(id.trim())) found.id = 'Enter six pairs of hexadecimal digits, separated by colons.';
  return found;
}
