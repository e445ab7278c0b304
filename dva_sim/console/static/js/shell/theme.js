/** Light or dark theme: the system's preference, until the person chooses. */
import { computed, effect, signal } from '../../vendor/preact.js';
import { DARK, LIGHT } from '../palette.js';

const KEY = 'dva-sim-theme';
const wish = window.matchMedia('(prefers-color-scheme: dark)');
const system = signal(wish.matches);
/** @type {import('../../vendor/preact.js').Signal<string | null>} */
const chosen = signal(remembered());

/** True while the theme is dark. */
export const dark = computed(() => (chosen.value ? chosen.value === 'dark' : system.value));
/** All colours of the current theme, by name. */
export const colours = computed(
  () => /** @type {Record<string, string>} */ (dark.value ? DARK : LIGHT),
);

wish.addEventListener('change', () => (system.value = wish.matches));
effect(() => {
  if (chosen.value) document.documentElement.dataset.theme = chosen.value;
});

/** Switch between light and dark, and save the choice. */
export function switchTheme() {
  chosen.value = dark.value ? 'light' : 'dark';
  try {
    localStorage.setItem(KEY, chosen.value);
  } catch {
    // A browser that keeps nothing shows the system's wish next time.
  }
}

function remembered() {
  try {
    const kept = localStorage.getItem(KEY);
    return kept === 'dark' || kept === 'light' ? kept : null;
  } catch {
    return null;
  }
}
