/** Says in red that an emergency stop is not confirmed, for as long as it is not. */
import { html } from '../../vendor/preact.js';
import { giveUp, unconfirmed } from '../net/emergency.js';

export function UnconfirmedStop() {
  return unconfirmed.value
    ? html`<p class="warning unconfirmed-stop">${unconfirmed.value} The robot stops by itself when it hears no
        commands. <button type="button" class="plain" onClick=${giveUp}>Stop asking</button></p>`
    : null;
}
