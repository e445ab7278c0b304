/** Frame of the screens: heading, link status, alerts, emergency stop. */
import { html, render, useEffect, useRef } from '../../vendor/preact.js';
import { connection, scene, seat } from '../store.js';
import { resumeStops } from '../net/emergency.js';
import { interrupted } from '../drive/hold.js';
import { Notices } from '../ui/notices.js';
import { capital } from '../ui/words.js';
import { AuthenticationScreen } from './authentication.js';
import { choices } from './choices.js';
import { robot } from './drive.js';
import { EmergencyFooter } from './emergency_footer.js';
import { lazy } from './lazy.js';
import { LinkStatus } from './link_status.js';
import { MainScreen } from './main_screen.js';
import { SCREENS, screen } from './screens.js';
import { TeleoperationScreen } from './teleoperation.js';

const MAP = ['/static/css/map.css', '/static/vendor/leaflet.css'];
const BODIES = /** @type {Record<string, any>} */ ({
  main: MainScreen,
  authentication: AuthenticationScreen,
  calibration: lazy(async () => (await import('./calibration.js')).CalibrationScreen),
  instructions: lazy(async () => (await import('./instructions.js')).InstructionsScreen),
  teleoperation: TeleoperationScreen,
  event: lazy(async () => (await import('./event.js')).EventScreen, MAP),
  missions: lazy(async () => (await import('./missions.js')).MissionsScreen, MAP),
  report: lazy(async () => (await import('./report.js')).ReportScreen, MAP),
});

/** @param {HTMLElement} where */
export function showPhone(where) {
  where.replaceChildren();
  render(html`<${App} />`, where);
  resumeStops();
}

function App() {
  const name = screen.value;
  const Screen = BODIES[name];
  const heading = useFocusAfterMove(name);
  return html`<div class=${`phone ${name} hand-${choices.value.hand}`}>
    <header class="top">
      ${name === 'main'
        ? html`<span class="brand">dva-sim</span>`
        : html`<a class="back" href="#/main">‹ Main</a>`}
      <h1 ref=${heading} tabindex="-1">${SCREENS[name]}</h1>
      <${LinkStatus} />
    </header>
    <${Alerts} />
    <main id="main">${scene.value ? html`<${Screen} key=${name} />` : html`<${Waiting} />`}</main>
    <${EmergencyFooter} robot=${robot.value} />
  </div>`;
}

/**
 * Focus the heading of the next screen, for users of keyboards and screen readers.
 * @param {string} name
 */
function useFocusAfterMove(name) {
  const heading = useRef(/** @type {HTMLElement | null} */ (null));
  const first = useRef(true);
  useEffect(() => {
    if (!first.current) heading.current?.focus();
    first.current = false;
    document.title = `${SCREENS[name]} – dva-sim phone`;
  }, [name]);
  return heading;
}

function Waiting() {
  const lost = connection.value === 'lost';
  return html`<p class="soft">${lost ? 'The console cannot be reached. Retrying …' : 'Waiting for the console …'}</p>`;
}

const STOPPED = 'stopped: '; // begins what the console says of an ended drive

/** Current problems, each with its consequence; that a drive has ended by a cause in the hand is none. */
function Alerts() {
  const alert = seat.value?.alert ?? '';
  const ended = !['open', 'connecting', 'lost'].includes(connection.value);
  const texts = [
    connection.value === 'lost' &&
      'link lost: the console cannot be reached. The robot stops by itself. Trying again …',
    ended && `The simulation has ended: ${connection.value}`,
    alert.startsWith(STOPPED) ? '' : alert,
  ];
  const ending = interrupted.value ? `${interrupted.value} The robot was stopped.` : alert.startsWith(STOPPED) && `${capital(alert)}.`;
  return html`<div class="alerts" role="alert">
    <${Notices} others=${texts} />
    ${texts.filter(Boolean).map((text) => html`<p class="warning" key=${text}>${text}</p>`)}
    ${ending && html`<p class="told">${ending} Start again when you are ready.</p>`}
  </div>`;
}
