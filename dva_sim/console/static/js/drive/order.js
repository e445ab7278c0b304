/** Current order: drive there, look, and report whether the event is real. */
import { html } from '../../vendor/preact.js';
import { maySteer, rows, seat, thingAt } from '../store.js';
import { act } from '../net/actions.js';
import { placeOf } from '../map/shown.js';
import { chooseRobots, driven } from '../shell/route.js';
import { capital, plain } from '../ui/words.js';

/** Newest order: that of this seat, else the one waiting for an operator. */
export function OrderInHand() {
  const mine = seat.value?.order ?? null;
  const order = mine ?? rows.value?.order ?? null;
  if (!order) return null;
  const robot = thingAt(order.robot)?.label ?? 'a robot';
  const here = driven.value.some((one) => one.i === order.robot);
  const holds = Boolean(seat.value?.drives.length);
  const off = !maySteer.value || !mine;
  return html`<section class="panel order" aria-label="Order in hand">
    <h2>Order: event ${order.event}, ${plain(order.kind)}</h2>
    <p class="reported">${capital(plain(order.kind))} reported ${placeOf(order)}. Drive ${robot} there, look, and say
      whether it is true.${mine ? '' : ' It waits for whoever takes control.'}</p>
    <div class="buttons">
      ${!here && html`<button type="button" key="call" class="go" disabled=${holds}
        onClick=${() => chooseRobots([robot])}>Choose ${robot}</button>`}
      <button type="button" disabled=${off} onClick=${() => act('confirm')}>Confirm</button>
      <button type="button" disabled=${off} onClick=${() => act('refute')}>Refute</button>
      <button type="button" disabled=${off} onClick=${() => act('decline')}>Decline</button>
    </div>
  </section>`;
}
