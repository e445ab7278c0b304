/** Light or dark: what the system wishes, until the person chooses. */
import { computed, effect, signal } from '../../vendor/preact.js';
import { DARK, LIGHT } from '../palette.js';

const KEY = 'dva-sim-theme';
const wish = window.matchMedia('(prefers-color-scheme: dark)');
const system = signal(wish.matches);
/** @type {import('../../vendor/preact.js').Signal<string | null>} */
const chosen = signal(remembered());

/** Whether the page is dark. */
export const dark = computed(() => (chosen.value ? chosen.value === 'dark' : system.value));
/** All colours, by name, as they are now. */
export const colours = computed(
  () => /** @type {Record<string, string>} */ (dark.value ? DARK : LIGHT),
);

wish.addEventListener('change', () => (system.value = wish.matches));
effect(() => {
  if (chosen.value) document.documentElement.dataset.theme = chosen.value;
});

/** Change sides, and remember it. */
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
