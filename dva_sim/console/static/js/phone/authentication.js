/** Authentication screen: register, list, choose, request permission; each step unlocks the next. */
import { html, useEffect, useState } from '../../vendor/preact.js';
import { isOperator, mayDrive, maySteer, notice, robots, scene, seat, thingAt } from '../store.js';
import { act } from '../net/actions.js';
import { choices, choose } from './choices.js';
import { holds, phone, robot } from './drive.js';
import { SCREENS } from './screens.js';
import { Choice, Field } from '../ui/fields.js';

const TYPES = /** @type {[string, string][]} */ (
  ['Robot', 'Remote Control', 'Teleoperation'].map((type) => [type, type])
);
const LEVELS = /** @type {[string, string][]} */ ([
  ['teleoperation', 'teleoperation'],
  ['missions', 'missions'],
  ['both', 'both'],
]);
const HOST = /^[A-Za-z0-9._:-]{1,64}$/;

/** The screen. */
export function AuthenticationScreen() {
  const [devices, know] = useState(/** @type {import('../lines.js').Device[] | null} */ (null));
  if (!mayDrive.value) {
    return html`<p>This address is view-only. Scan the code that the console shows for phones.</p>`;
  }
  const registered = Boolean(phone.value?.registered);
  const own = isOperator.value && !registered;
  return html`<ol class="steps">
    <${Register} />
    ${own && html`<${AsOperator} />`}
    <${DeviceList} devices=${devices} know=${know} off=${!registered} />
    <${Permission} devices=${devices} off=${!registered} />
  </ol>
  ${holds.value && html`<div class="thumb"><p>${robot.value?.label ?? 'The robot'} is in your hands.</p>
    <button type="button" onClick=${() => act('release')}>Give it back</button>
    <a class="big go" href=${`#/${next()}`}>
      Go on: ${SCREENS[next()]}</a></div>`}`;
}

/** Screen on which the permission is used, or prepared for. */
function next() {
  if (phone.value?.level === 'missions') return 'missions';
  return phone.value?.calibrated ? 'teleoperation' : 'calibration';
}

/** Fill empty fields with what the console knows. */
function useDefaults() {
  const address = scene.value?.dva_address ?? '';
  useEffect(() => {
    const [server, port] = splitAddress(address);
    const kept = choices.peek();
    choose({
      server: kept.server || server,
      port: kept.port || port,
      label: kept.label || defaultLabel(),
    });
  }, [address]);
}

/** @param {string} address */
function splitAddress(address) {
  const at = address.lastIndexOf(':');
  return at < 0 ? ['', ''] : [address.slice(0, at), address.slice(at + 1)];
}

/** Default label: the kind of device as the browser reports it, and a random number. */
function defaultLabel() {
  const kind = /iPhone|iPad|Android/.exec(navigator.userAgent)?.[0] ?? 'Browser';
  return `${kind} ${Math.floor(100 + 900 * Math.random())}`;
}

function Register() {
  useDefaults();
  const [marked, mark] = useState(false);
  const [open, unfold] = useState(false);
  const { server, port, label, type } = choices.value;
  const wrong = {
    server: HOST.test(server.trim()) ? '' : 'Enter an address such as 127.0.0.1.',
    port: isPort(port) ? '' : 'Enter a whole number from 1 to 65535.',
    label: label.trim() ? '' : 'Enter a few words that describe this device.',
  };
  const known = phone.value;
  const [asking, ask] = useState(false);
  const register = async () => {
    mark(true);
    if (asking || wrong.server || wrong.port || wrong.label) return;
    ask(true);
    const done = await act('phone_register', {
      server: server.trim(),
      port: Number(port),
      label: label.trim(),
      type,
    });
    ask(false);
    if (done.ok) unfold(false);
  };
  if (known?.registered && !open) {
    return html`<li class="step done"><h2>Register</h2>
      <p>${known.label} is registered as ${known.id} at ${known.address}.
        <button type="button" class="plain" onClick=${() => unfold(true)}>Change</button></p></li>`;
  }
  return html`<li class="step now"><h2>Register</h2>
    <div class="pair">
    <${Field} name="Server IP" value=${server} wrong=${marked && wrong.server} mode="url"
      onInput=${(/** @type {string} */ text) => choose({ server: text })} />
    <${Field} name="Port" value=${port} wrong=${marked && wrong.port} mode="numeric" most=${5}
      onInput=${(/** @type {string} */ text) => choose({ port: text })} /></div>
    <${Field} name="Device label" value=${label} wrong=${marked && wrong.label}
      onInput=${(/** @type {string} */ text) => choose({ label: text })} />
    <${Choice} name="Device type" value=${type} options=${TYPES}
      onInput=${(/** @type {string} */ value) => choose({ type: value })} />
    <button type="button" class="big go" disabled=${!maySteer.value} onClick=${register}>Register</button>
    <p role="status" aria-label="Registration">${asking && `Asking the DVA at ${server}:${port} …`}</p>
  </li>`;
}

/** @param {string} text */
const isPort = (text) => /^\d{1,5}$/.test(text) && Number(text) >= 1 && Number(text) <= 65535;

/** Driving as the console's operator: its own address needs no registration. */
function AsOperator() {
  const held = seat.value?.drives[0]?.i;
  const [chosen, take] = useState(String(held ?? robots.value[0]?.i ?? ''));
  const options = /** @type {[string, string][]} */ (robots.value.map((one) => [String(one.i), one.label]));
  return html`<li class="step"><h2>Or drive as the console’s operator</h2>
    <p>This address may drive already. You need not register.</p>
    ${held === undefined
      ? html`<${Choice} name="Robot" value=${chosen} options=${options} onInput=${take} />
        <button type="button" class="big" disabled=${!maySteer.value}
          onClick=${() => act('take', { robots: [Number(chosen)] })}>Take control</button>`
      : html`<p>${thingAt(held)?.label} is yours.</p>`}
  </li>`;
}

/**
 * @param {{devices: import('../lines.js').Device[] | null, know: (all: any) => void, off: boolean}} props
 */
function DeviceList({ devices, know, off }) {
  const ask = async () => {
    const done = await act('phone_devices');
    if (!done.ok || !done.devices) return;
    const all = robotsOf(done.devices);
    know(all);
    if (!all.some((one) => one.id === choices.peek().device)) choose({ device: all[0]?.id ?? '' });
  };
  const options = /** @type {[string, string][]} */ ((devices ?? []).map((one) => [one.id, entry(one)]));
  return html`<li class=${off ? 'step off' : 'step'}><h2>Choose a device</h2>
    <button type="button" class=${devices || off ? 'big' : 'big go'} disabled=${off || !maySteer.value}
      onClick=${ask}>Get device list</button>
    ${devices?.length === 0 && html`<p>No robot is registered.</p>`}
    <${Choice} name="Device" value=${options.length ? choices.value.device : ''} disabled=${off || !options.length}
      options=${options.length ? options : [['', 'not listed yet']]}
      onInput=${(/** @type {string} */ id) => choose({ device: id })} />
  </li>`;
}

/** @param {import('../lines.js').Device[]} devices */
function robotsOf(devices) {
  const found = devices.filter((one) => one.type === 'Robot');
  return found.sort((a, b) => a.label.localeCompare(b.label, 'en', { numeric: true }));
}

/** Device entry in the notation of the founding document. @param {import('../lines.js').Device} device */
const entry = ({ type, label, address, id }) => `${type} = ${label}@${address}(${id})`;

/** @param {{devices: import('../lines.js').Device[] | null, off: boolean}} props */
function Permission({ devices, off }) {
  const { device, level } = choices.value;
  const unlisted = off || !devices?.some((one) => one.id === device);
  const ask = async () => {
    const done = await act('phone_permission', { device, level });
    if (!done.ok) notice.value = `No permission: ${done.text}`;
  };
  const held = phone.value?.device && holds.value;
  return html`<li class=${unlisted ? 'step off' : 'step'}><h2>Ask for permission</h2>
    ${held && html`<p>You have permission: ${phone.value?.level}.</p>`}
    <${Choice} name="Permission level" value=${level} options=${LEVELS} disabled=${unlisted}
      onInput=${(/** @type {string} */ value) => choose({ level: value })} />
    <button type="button" class=${unlisted || held ? 'big' : 'big go'} disabled=${unlisted || !maySteer.value}
      onClick=${ask}>Get Permission Level</button>
  </li>`;
}
