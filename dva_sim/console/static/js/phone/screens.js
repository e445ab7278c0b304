/** Current screen, kept in the address so that a reload shows the same. */
import { computed, signal } from '../../vendor/preact.js';

/** Names of the screens with their headings, in the order of the menu. */
export const SCREENS = /** @type {Record<string, string>} */ ({
  main: 'Main',
  authentication: 'Authentication',
  calibration: 'Calibration',
  instructions: 'Instructions',
  teleoperation: 'Teleoperation',
  missions: 'Missions',
  event: 'Event',
  report: 'Report',
});
/** Screens of the menu. */
export const MENU = ['authentication', 'calibration', 'instructions', 'teleoperation', 'missions', 'report'];
const hash = signal(location.hash);
window.addEventListener('hashchange', () => (hash.value = location.hash));

/** Text behind the name of the screen in the address. */
export const subject = computed(() => hash.value.split('?')[1] ?? '');

export const screen = computed(() => {
  const name = hash.value.replace(/^#\/?/, '').split('?')[0];
  return name in SCREENS ? name : 'main';
});
