/** Red warning, shown while an emergency stop is not confirmed. */
import { html } from '../../vendor/preact.js';
import { giveUp, unconfirmed } from '../net/emergency.js';

export function UnconfirmedStop() {
  return unconfirmed.value
    ? html`<p class="warning unconfirmed-stop">${unconfirmed.value} A driven robot stops by its watchdog; a robot
        on a mission may go on. <button type="button" class="plain" onClick=${giveUp}>Stop asking</button></p>`
    : null;
}
