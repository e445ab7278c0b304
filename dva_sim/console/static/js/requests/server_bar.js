/** Server bar: state and address of the DVA's server, and buttons to start and stop it. */
import { html, useState } from '../../vendor/preact.js';
import { MAX_PORT } from '../declared.js';
import { maySteer, rows } from '../store.js';
import { act } from '../net/actions.js';
import { Field, wrongNumber } from '../ui/fields.js';


/** The panel. */
export function ServerBar() {
  const server = rows.value?.server;
  const [port, setPort] = useState(/** @type {string | null} */ (null));
  if (!server) return null;
  const { listens, modelled } = server;
  const answers = listens && (server.hearing ?? 'answers') === 'answers';
  const shown = port ?? String(server.port ?? '');
  const wrong = listens || server.port === null ? '' : wrongNumber(shown, 1, MAX_PORT, '');
  const start = () => act('server_start', { port: Number(shown) });
  return html`<section class="panel server" aria-label="Server">
    <p role="status" aria-label="Server state" class=${answers ? 'state reported' : 'state stopped reported'}>
      <i class=${answers ? 'lamp on' : 'lamp'} aria-hidden="true"></i>${stateText(server)}</p>
    ${server.own !== false &&
    html`<div class="server-controls">
      <${Field} name="Port" value=${shown} mode="numeric" most=${5} disabled=${listens || !maySteer.value}
        wrong=${wrong && 'Enter a port from 1 to 65534.'} onInput=${setPort} />
      <button type="button" disabled=${listens || Boolean(wrong) || !maySteer.value} onClick=${start}>Start server</button>
      <button type="button" disabled=${!listens || !maySteer.value} onClick=${() => act('server_stop')}>Stop server</button>
    </div>`}
    ${modelled && html`<p class="soft">Links are simulated: no port of this computer is open.</p>`}
  </section>`;
}

/** @param {{listens: boolean, address: string, own?: boolean, hearing?: string}} server */
function stateText({ listens, address, own, hearing }) {
  if (hearing === 'never' && (own === false || listens)) return `No DVA at ${address} yet`;
  if (hearing === 'silent' && (own === false || listens)) return `The DVA at ${address} is silent`;
  if (own === false) return `The DVA at ${address} answers`;
  return listens ? `Listening on ${address}` : 'Stopped: requests are not answered';
}
