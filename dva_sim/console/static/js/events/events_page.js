/**
 * Events page: what is wrong, who could go, send, see, close.
 *
 * Three columns: the list, the map with a picture, and the event in hand. None is below the fold.
 */
import { html, useEffect } from '../../vendor/preact.js';
import { connection, isPast, mayDispatch, you } from '../store.js';
import { act, ask, showRefusal } from '../net/actions.js';
import { workByKeys } from './desk_keys.js';
import { DeskHead } from './desk_head.js';
import { DeskList } from './desk_list.js';
import { EventPanel } from './event_panel.js';
import { Shift } from './handing_over.js';
import { Raise } from './raise.js';
import { onShift, ownName, raising } from './shared.js';
import { Sight } from './sight.js';

/** The page. */
export function EventsPage() {
  useEffect(keepJoining, [you.value?.client, connection.value, mayDispatch.value]);
  useEffect(workByKeys, []);
  return html`<main class="page events-page" id="main" tabindex="-1">
    <h1 class="hidden">Events</h1>
    <div class="desk-list">${!isPast.value && html`<${DeskHead} join=${join} />`}<${DeskList} /></div>
    <${Sight} />
    <div class="desk-panel"><${Panel} /></div>
  </main>`;
}

function Panel() {
  if (raising.value) return html`<${Raise} />`;
  return onShift.value ? html`<${Shift} close=${() => (onShift.value = false)} />` : html`<${EventPanel} />`;
}

const REFRESH_MS = 1000;

/** Register this console as a device at the DVA; its decisions are made in that name. */
const join = () => act('room_join', { name: ownName.peek() });

/** Join, retrying until it succeeds, where the address and the connection permit it. */
function keepJoining() {
  if (!mayDispatch.peek() || connection.peek() !== 'open') return undefined;
  let over = false;
  const again = async () => {
    const done = await ask('room_join', { name: ownName.peek() });
    if (done.outcome === 'refused') showRefusal(done);
    else if (!done.ok && !over) window.setTimeout(again, REFRESH_MS);
  };
  again();
  return () => {
    over = true;
  };
}
