/** Main screen: the menu, and the open events. */
import { html } from '../../vendor/preact.js';
import { ageOf } from '../net/world_time.js';
import { hasPlayedGuards, NO_PLAYED_GUARD } from '../guard/played.js';
import { eventsInOrder, isOpen, noEventText, placeOf } from '../map/shown.js';
import { dark, switchTheme } from '../shell/theme.js';
import { SeverityMark } from '../ui/icon.js';
import { ageText, capital, plain } from '../ui/words.js';
import { holds, isKnown, phone } from './drive.js';
import { MENU, SCREENS } from './screens.js';

/** The screen. */
export function MainScreen() {
  const done = /** @type {Record<string, string>} */ ({
    authentication: isKnown.value ? (holds.value ? 'a robot is in your hands' : 'registered') : '',
    calibration: phone.value?.calibrated ? 'done' : '',
  });
  return html`<nav class="menu" aria-label="Screens">
      ${MENU.map((name) => html`<a class="big" href=${`#/${name}`}>${SCREENS[name]}
        ${done[name] && html`<small>${done[name]}</small>`}</a>`)}
    </nav>
    <${Events} />
    <p class="ends">${hasPlayedGuards.value
      ? html`<a href="/guard">I am a guard</a>`
      : html`<span class="soft">${NO_PLAYED_GUARD}</span>`}
      <button type="button" class="plain" onClick=${switchTheme}>
        ${dark.value ? 'Light colours' : 'Dark colours'}</button></p>`;
}

function Events() {
  const open = eventsInOrder().filter(isOpen);
  return html`<section aria-label="Events"><h2>Events <span class="count">${open.length} open</span></h2>
    ${open.length === 0 && html`<p class="soft">${noEventText()}</p>`}
    <ul class="cards reported">${open.map(
      (event) => html`<li key=${event.number}><${SeverityMark} severity=${event.severity} />
        <span class="what"><b>${capital(plain(event.kind))}</b> ${placeOf(event)}
          <small>${event.severity}, ${plain(event.state)} ${ageText(ageOf(event.since_ms))}</small></span>
        <a class="go" href=${`#/event?${event.number}`} aria-label=${`Open event ${event.number}`}>Open</a></li>`,
    )}</ul></section>`;
}
