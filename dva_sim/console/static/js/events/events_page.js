/** Events page: alarms, events, the current one with its actions, and how orders are given. */
import { html, useEffect } from '../../vendor/preact.js';
import { allowed, connection, control, isDispatcher, isPast, mayDispatch, maySupervise, you } from '../store.js';
import { act, ask, showRefusal } from '../net/actions.js';
import { Choice, Field } from '../ui/fields.js';
import { AlarmList } from './alarm_list.js';
import { EventPanel } from './event_panel.js';
import { EventsTable } from './events_table.js';
import { Raise } from './raise.js';
import { mode, ownName, rename } from './shared.js';

const MODES = /** @type {[string, string][]} */ ([
  ['automatic', 'the policy, by itself'],
  ['ask_first', 'people: the policy asks first'],
]);

/** The page. */
export function EventsPage() {
  useEffect(keepJoining, [you.value?.client, connection.value, mayDispatch.value]);
  return html`<main class="page events-page" id="main" tabindex="-1">
    <h1 class="hidden">Events</h1>
    <div class="events-list">${!isPast.value && html`<${Head} /><${AlarmList} />`}<${EventsTable} /></div>
    <div class="events-side"><${EventPanel} />${!isPast.value && html`<${Raise} />`}</div>
  </main>`;
}

const AGAIN_MS = 1000;

/** Register this console as a device at the DVA; its decisions are made in that name. */
const join = () => act('room_join', { name: ownName.peek() });

/** Join, retrying until it succeeds, where the address and the connection permit it. */
function keepJoining() {
  if (!mayDispatch.peek() || connection.peek() !== 'open') return undefined;
  let over = false;
  const again = async () => {
    const done = await ask('room_join', { name: ownName.peek() });
    if (done.outcome === 'refused') showRefusal(done);
    else if (!done.ok && !over) window.setTimeout(again, AGAIN_MS);
  };
  again();
  return () => {
    over = true;
  };
}

const byDva = () => `The DVA lets this console ${allowed.value}.`;
const byAddress = () => `This address may ${you.value?.role ?? 'look'}. Those for dispatch and for
  supervision are printed where the console was started.`;

function Head() {
  if (!mayDispatch.value) {
    return html`<p class="soft events-head">${isDispatcher.value ? byDva() : byAddress()}</p>`;
  }
  const me = control.value?.rooms?.find((room) => room.client === you.value?.client);
  const asked = control.value?.dispatch;
  return html`<section class="events-head" aria-label="You">
    <${Field} name="Your name" value=${ownName.value} onInput=${rename}
      hint=${me ? `The log shows you as ${me.label}` : 'As shown in the log'} />
    <button type="button" onClick=${join}>Use this name</button>
    ${asked && html`<${Choice} name="Who decides" value=${mode.value} options=${MODES}
      disabled=${!maySupervise.value} onInput=${(/** @type {string} */ to) => act('dispatch_mode', { mode: to })} />`}
    ${asked?.switched && html`<small class="soft">set by ${asked.switched.label}</small>`}
  </section>`;
}
