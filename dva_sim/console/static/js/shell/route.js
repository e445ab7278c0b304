/** Current page, kept in the address: a reload or a shared link shows the same page. */
import { computed, signal } from '../../vendor/preact.js';
import { robots, scene } from '../store.js';

const PAGES = [
  ...['map', 'main', 'devices', 'robots', 'drive', 'events', 'network', 'audit'],
  ...['story', 'recordings'],
];
const MAX_AT_ONCE = 2;
const hash = signal(location.hash);
window.addEventListener('hashchange', () => {
  hash.value = location.hash;
  goElsewhere();
});
goElsewhere();

/** Redirect to the pages of phones and guards, which are separate documents. */
function goElsewhere() {
  const found = /^#\/(phone|guard)(\/\w+)?$/.exec(location.hash);
  if (found) location.replace(`/${found[1]}#${found[2] ?? '/main'}`);
}

const parts = computed(() => {
  const [path, query = ''] = hash.value.replace(/^#\/?/, '').split('?');
  const [name, ...rest] = path.split('/');
  return { path: name, detail: decoded(rest.join('/')), query: new URLSearchParams(query) };
});

/** Part of the address after the page's name, as in `#/robots/robot-1`; empty if there is none. */
export const detail = computed(() => parts.value.detail);

/** @param {string} text */
function decoded(text) {
  try {
    return decodeURIComponent(text);
  } catch {
    return text;
  }
}

export const page = computed(() => (PAGES.includes(parts.value.path) ? parts.value.path : (scene.value?.begins_at ?? scene.value?.pages?.[0] ?? 'map')));

/** Robots being watched or driven: those in the address, else the first one. */
export const driven = computed(() => {
  const wanted = (parts.value.query.get('robots') ?? '').split(',');
  const found = wanted.flatMap((label) => robots.value.filter((robot) => robot.label === label));
  const some = found.length ? found : robots.value.slice(0, 1);
  return some.slice(0, MAX_AT_ONCE);
});

/** @param {string} name */
export const addressOf = (name) => {
  const chosen = parts.value.query.get('robots');
  return `#/${name}${chosen ? `?robots=${encodeURIComponent(chosen)}` : ''}`;
};

/** @param {string[]} labels */
export function chooseRobots(labels) {
  const unique = [...new Set(labels.filter(Boolean))].slice(0, MAX_AT_ONCE);
  location.hash = `#/drive?robots=${unique.map(encodeURIComponent).join(',')}`;
}
