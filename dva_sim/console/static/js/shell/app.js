/** The shell: bar, rail, warnings, and the page named in the address. */
import { html, render } from '../../vendor/preact.js';
import {
  clock, connection, isAttached, isPast, replay, scene, shelf,
} from '../store.js';
import { AuditPage } from '../audit/audit_page.js';
import { DevicesPage } from '../devices/devices_page.js';
import { DrivePage } from '../drive/drive_page.js';
import { EventsPage } from '../events/events_page.js';
import { Offers } from '../events/handing_over.js';
import { Help } from '../help/help.js';
import { MapPage } from '../map/map_page.js';
import { NetworkPage } from '../network/network_page.js';
import { ReplayBar } from '../replay/replay_bar.js';
import { ShelfPage } from '../replay/shelf_page.js';
import { StoryPage } from '../replay/story_page.js';
import { RequestsPage } from '../requests/requests_page.js';
import { RobotsPage } from '../robots/robots_page.js';
import { Tour, TourButton } from '../tour/tour.js';
import { Icon } from '../ui/icon.js';
import { Notices } from '../ui/notices.js';
import { resumeStops } from '../net/emergency.js';
import { Bar } from './bar.js';
import { callThePerson, Strip } from './calling.js';
import { PhoneButton, PhoneCode } from './phones.js';
import { addressOf, page } from './route.js';

const PAGES = /** @type {[string, string, string][]} */ ([
  ['map', 'Map', 'map'],
  ['main', 'Main', 'list'],
  ['devices', 'Devices', 'router'],
  ['robots', 'Robots', 'bot'],
  ['drive', 'Drive', 'gamepad-2'],
  ['events', 'Events', 'flag'],
  ['network', 'Network', 'activity'],
  ['audit', 'Audit', 'shield-check'],
]);
const NOT_ATTACHED = ['robots', 'network']; // of which messages tell nothing
// What sends something is not there in a recording.
const OF_A_RECORDING = /** @type {[string, string, string][]} */ ([
  ['map', 'Map', 'map'],
  ['main', 'Main', 'list'],
  ['devices', 'Devices', 'router'],
  ['robots', 'Robots', 'bot'],
  ['events', 'Events', 'flag'],
  ['story', 'Story', 'activity'],
  ['audit', 'Audit', 'shield-check'],
]);
const SHELF = /** @type {[string, string, string]} */ (['recordings', 'Recordings', 'play']);
const BODIES = /** @type {Record<string, any>} */ ({
  map: MapPage,
  main: RequestsPage,
  devices: DevicesPage,
  robots: RobotsPage,
  drive: DrivePage,
  events: EventsPage,
  network: NetworkPage,
  audit: AuditPage,
  story: StoryPage,
  recordings: ShelfPage,
});

/** @param {HTMLElement} where */
export function showApp(where) {
  where.replaceChildren();
  render(html`<${App} />`, where);
  callThePerson();
  resumeStops();
}

function App() {
  const Page = BODIES[shown()];
  return html`<a class="skip" href="#main" onClick=${skip}>Skip to content</a>
    <${Bar} /><${Rail} />
    <div class="body"><${Strip} /><${Offers} /><${Warnings} /><${Tour} /><${ReplayBar} />${scene.value ? html`<${Page} />` : html`<${Waiting} />`}</div>
    <${Help} /><${PhoneCode} />`;
}

/** @param {Event} event */
function skip(event) {
  event.preventDefault();
  document.getElementById('main')?.focus();
}

/** Pages that are available. */
function pages() {
  const some = scene.value?.pages;
  if (some) return PAGES.filter(([name]) => some.includes(name));
  if (isAttached.value) return PAGES.filter(([name]) => !NOT_ATTACHED.includes(name));
  if (!isPast.value) return PAGES;
  const past = replay.value ? OF_A_RECORDING.filter(([name]) => name !== 'audit' || replay.value?.audit) : [];
  return shelf.value ? [...past, SHELF] : past;
}

/** Page named in the address, or the first available one. */
function shown() {
  const names = pages().map(([name]) => name);
  return names.includes(page.value) ? page.value : (scene.value?.pages?.[0] ?? names[0] ?? SHELF[0]);
}

function Rail() {
  return html`<nav class="rail" aria-label="Pages">
    ${pages().map(
      ([name, title, icon]) => html`<a href=${addressOf(name)}
        aria-current=${shown() === name ? 'page' : null}><${Icon} name=${icon} /><span>${title}</span></a>`,
    )}
    ${!isPast.value && !scene.value?.pages && html`<${PhoneButton} /><${TourButton} />`}
  </nav>`;
}

function Waiting() {
  const text =
    connection.value === 'lost'
      ? 'The simulation cannot be reached. Retrying …'
      : 'Waiting for the simulation …';
  return html`<main class="page waiting" id="main" tabindex="-1"><h1>dva-sim</h1><p>${text}</p></main>`;
}

/** Warnings, each with its consequence. */
function Warnings() {
  const { lag_s: lag, held_by_lag: held } = clock.value;
  const limit = Math.round(1000 * (scene.value?.lag_limit_s ?? 0.25));
  const ended = !['open', 'connecting', 'lost'].includes(connection.value);
  return html`<div class="warnings" role="alert">
    <${Notices} />
    ${held &&
    html`<p class="warning">Robots were stopped: the simulation fell more than ${limit} ms behind real time, so you no
      longer saw what you were steering. ${lag > limit / 1000
        ? `It is ${Math.round(1000 * lag)} ms behind now.`
        : 'It has caught up now.'} You can drive again once it has kept up for a moment.</p>`}
    ${connection.value === 'lost' &&
    html`<p class="warning">The connection to the simulation is lost. What you see is out of date. Robots you were driving
      have been stopped. Retrying …</p>`}
    ${ended && html`<p class="warning">The simulation has ended: ${connection.value}</p>`}
  </div>`;
}
