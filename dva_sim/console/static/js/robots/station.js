/** Stages of a robot: off, registered, listening, and its mode from then on. */
import { html, useState } from '../../vendor/preact.js';
import { maySteer, modeOf } from '../store.js';
import { act } from '../net/actions.js';
import { Field } from '../ui/fields.js';
import { windowOf } from './window.js';

const STEPS = ['off', 'registered', 'listening'];

/** @param {{robot: import('../lines.js').Thing}} props */
export function Station({ robot }) {
  const station = windowOf(robot.i)?.station;
  if (!station) return null;
  const at = STEPS.indexOf(station.state);
  const last = station.state === 'listening' ? modeOf(robot.i) : 'Idle, Mission or Teleoperation';
  const now = station.state === 'listening' ? STEPS.length : at;
  return html`<ol class="steps reported" aria-label="State">${[...STEPS, last].map(
    (step, n) => html`<li class=${n <= Math.max(at, now) ? 'past' : ''} aria-current=${n === now ? 'step' : null}>${step}</li>`,
  )}</ol>
    ${station.by_hand ? html`<${Steps} robot=${robot} station=${station} />` : html`<p class="soft">It registers by itself and listens on ${station.address}.</p>`}`;
}

/** @param {{robot: import('../lines.js').Thing, station: import('../lines.js').Station}} props */
function Steps({ robot, station }) {
  const [dva, setDva] = useState(station.dva || '127.0.0.1:5600');
  const may = maySteer.value;
  const off = station.state === 'off';
  const ask = (/** @type {import('../net/actions.js').Action} */ what, more = {}) => act(what, { robot: robot.i, ...more });
  return html`<div class="station">
    <${Field} name="DVA" value=${dva} disabled=${!off || station.asking} hint="HOST:PORT of a DVA or a DVA simulator" onInput=${setDva} />
    <div class="buttons">
      <button type="button" disabled=${!may || !off || station.asking} onClick=${() => ask('robot_register', { dva })}>Register</button>
      <button type="button" disabled=${!may || station.state !== 'registered'} onClick=${() => ask('robot_listen')}>Open port</button>
      <button type="button" disabled=${!may || off} onClick=${() => ask('robot_off')}>Switch off</button>
    </div>
    <p class="soft" role="status" aria-label="Station">${station.problem || stationText(station)}</p>
  </div>`;
}

/** @param {import('../lines.js').Station} station */
function stationText(station) {
  if (station.asking) return `Asking ${station.dva} …`;
  if (station.state === 'off') return `The robot is off and cannot be reached. It will listen on ${station.address}.`;
  if (station.state === 'registered') return `Registered at ${station.dva} as ${station.address}; its port is closed.`;
  return `Registered at ${station.dva}; listening on ${station.address}.`;
}
