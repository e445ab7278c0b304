/** Map page: the map, and the same as lists. */
import { html } from '../../vendor/preact.js';
import { robots, selection } from '../store.js';
import { Card } from './card.js';
import { Lists } from './lists.js';
import { MapBox } from './map_box.js';
import { drawRegions } from './regions.js';

const FEW = 12;

/** Robots whose field of view is drawn: all while they are few, else the selected one. */
function cones() {
  const all = robots.peek().map((robot) => robot.i);
  if (all.length <= FEW) return all;
  const chosen = selection.peek();
  return chosen?.kind === 'thing' && all.includes(chosen.key) ? [chosen.key] : [];
}

/** The page. */
export function MapPage() {
  return html`<main class="page map-page" id="main" tabindex="-1">
    <h1 class="hidden">Map</h1>
    <section class="map-region" aria-label="Map">
      <${MapBox} cones=${cones} under=${drawRegions} follows=${() => robots.peek()[0]?.i ?? null} />
      <${Card} />
    </section>
    <${Lists} />
  </main>`;
}
