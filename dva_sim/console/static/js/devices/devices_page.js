/** Devices page: connected devices and their holders; fake devices can be added. */
import { html, useState } from '../../vendor/preact.js';
import { deviceList, isAttached, isPast, maySteer, maySupervise, rows, scene } from '../store.js';
import { act } from '../net/actions.js';
import { sinceSent } from '../net/world_time.js';
import { useTable } from '../logs/looking.js';
import { Icon } from '../ui/icon.js';
import { isNumber } from '../ui/words.js';
import { FakeForm } from './fake_form.js';

const HEADS = /** @type {[string, string][]} */ ([
  ['Label', ''], ['Type', ''], ['Id', ''], ['Address', ''], ['Link', ''], ['Doing', ''], ['Heard', 's ago'],
  ['Heartbeats', '1/s'], ['Commands', '1/s'], ['Refused', ''], ['Picture', 's old'], ['Round trip', 'ms'],
  ['Holder', ''], ['Level', ''], ['Session ends', ''], ['', ''],
]);

/** The page. */
export function DevicesPage() {
  useTable('devices');
  const [isAdding, setAdding] = useState(false);
  const list = [...deviceList.value.devices].sort(byKind);
  const isDivided = Boolean(scene.value?.site?.regions.length);
  const heads = isDivided ? [...HEADS.slice(0, 2), ['DVA', ''], ...HEADS.slice(2)] : HEADS;
  return html`<main class="page devices-page" id="main" tabindex="-1">
    <h1 class="hidden">Devices</h1>
    <section class="panel" aria-label="Devices known to the DVA">
      <div class="head"><h2>Devices <span class="count">${list.length}</span></h2>
        ${maySteer.value && html`<button type="button" key="add" aria-expanded=${isAdding}
          onClick=${() => setAdding(!isAdding)}><${Icon} name="plus" /> Add fake device</button>`}</div>
      ${isAdding && html`<${FakeForm} onDone=${() => setAdding(false)} />`}
      <div class="scrolls" tabindex="0" role="group" aria-label="Table, scrolls sideways">
        <table aria-label="Devices">
          <thead><tr>${heads.map(([head, unit]) => html`<th scope="col">${head || html`<span class="hidden">Actions</span>`}${
            unit && html`<small> ${unit}</small>`}</th>`)}</tr></thead>
          <tbody class="reported">${list.map((device) => html`<${Row} key=${device.id} device=${device} isDivided=${isDivided} />`)}</tbody>
        </table>
        ${!list.length && html`<p class="soft">${rows.value?.server?.own === false ? 'The DVA has not told its devices yet.' : 'No device is registered.'}</p>`}
      </div>
    </section>
  </main>`;
}

const ORDER = ['Robot', 'Guard', 'TeleOp', 'Teleoperation', 'Remote Control', 'ControlRoom', 'Sensor'];

/**
 * @param {any} a
 * @param {any} b
 */
const byKind = (a, b) =>
  ORDER.indexOf(a.type) - ORDER.indexOf(b.type) || a.id.localeCompare(b.id);

/** @param {{device: any, isDivided: boolean}} props */
function Row({ device, isDivided }) {
  const later = sinceSent(deviceList.value);
  return html`<tr class=${device.silent ? 'silent' : ''}>
    <th scope="row">${device.label}${device.fake && html` <span class="tag">fake</span>`}</th>
    <td>${device.type}</td>${isDivided && html`<td>${device.dva ?? '–'}</td>`}<td>${device.id}</td><td>${device.address}</td>
    <td><${Health} device=${device} /></td>
    <td>${device.doing ?? (isAttached.value ? UNKNOWN : '–')}</td>
    <td class="n">${number(device.heard_s, 1, later)}</td><td class="n">${number(device.beats_hz, 1)}</td>
    <td class="n">${number(device.commands_hz, 1)}</td><td class="n">${number(device.refused, 0)}</td>
    <td class="n">${number(device.picture_age_s, 1, later)}</td>
    <td class="n">${number(isNumber(device.round_trip_s) ? 1000 * device.round_trip_s : null, 0)}</td>
    <td>${holderOf(device)}</td>
    <td>${device.level ?? (device.holder ? UNKNOWN : '–')}</td>
    <td>${endText(device, later)}</td>
    <td><div class="acts">${!isPast.value && device.holder && device.revocable !== false && html`<button type="button" key="take-back" disabled=${!maySteer.value || !maySupervise.value}
        aria-label=${`Revoke the permission for ${device.label}`} onClick=${() => act('revoke', { device: device.id })}>Revoke</button>`}
      ${device.fake && html`<button type="button" key="remove" disabled=${!maySteer.value} aria-label=${`Remove ${device.label}`}
        onClick=${() => act('fake_remove', { device: device.id })}>Remove</button>`}</div></td>
  </tr>`;
}

const UNKNOWN = html`<span class="soft">unknown</span>`;
const BARS = /** @type {Record<string, number>} */ ({ good: 4, fair: 3, poor: 2, lost: 0 });

/** Bars and a word. @param {{device: any}} props */
function Health({ device }) {
  const { link } = device;
  if (!link) return '–';
  return html`<span class=${`health ${link}`}><svg viewBox="0 0 16 12" aria-hidden="true" focusable="false">
    ${[0, 1, 2, 3].map((bar) => html`<rect x=${4 * bar} y=${9 - 3 * bar} width="3" height=${3 + 3 * bar}
      class=${bar < BARS[link] ? 'full' : ''} />`)}</svg> ${link}</span>`;
}

/**
 * @param {number | null | undefined} value
 * @param {number} digits
 * @param {number} [later] time to add, since the value was sent
 */
function number(value, digits, later = 0) {
  if (isNumber(value)) return (/** @type {number} */ (value) + later).toFixed(digits);
  return isAttached.value ? UNKNOWN : '–';
}

/** @param {any} device */
function holderOf(device) {
  if (device.holder) return device.holder_label || device.holder;
  return device.holder_known === false ? UNKNOWN : '–';
}

/** @param {any} device @param {number} later */
function endText(device, later) {
  if (!device.holder) return '–';
  if (isAttached.value) return UNKNOWN;
  return isNumber(device.ends_s) ? `in ${Math.max(0, Math.round(device.ends_s - later))} s` : 'when given back';
}
