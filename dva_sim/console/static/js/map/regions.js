/** Regions of a site with several DVAs: their borders, and who serves each. */
import { html } from '../../vendor/preact.js';
import { isPast, maySteer, maySupervise, rows, scene } from '../store.js';
import { act } from '../net/actions.js';
import { lettersOn } from './lettering.js';

const COLOURS = { served: 'room-name', deputy: 'warning', dead: 'danger' };
const DASHES = [10, 4, 2, 4];

/**
 * Draw the borders, and the name of each region with its DVA.
 * @param {import('./bodies.js').Pen} pen
 * @param {import('./lettering.js').Place[]} written
 */
export function drawRegions({ ctx, affine, colours }, written) {
  const letters = lettersOn(ctx) + 1;
  ctx.font = `600 ${letters}px system-ui, sans-serif`;
  ctx.textAlign = 'left';
  ctx.textBaseline = 'bottom';
  ctx.lineJoin = 'round';
  for (const region of scene.peek()?.site.regions ?? []) {
    const served = rows.peek()?.regions?.find(({ name }) => name === region.name);
    ctx.lineWidth = 1.5;
    ctx.strokeStyle = colours.edge;
    ctx.setLineDash(DASHES);
    for (const border of region.borders_m) {
      ctx.beginPath();
      for (const [x, y] of border) ctx.lineTo(...affine.pixel(x, y));
      ctx.stroke();
    }
    ctx.setLineDash([]);
    const text = served ? `${region.name}: ${served.text}` : region.name;
    const [x, y] = affine.pixel(region.place_m[0], region.place_m[1]);
    const [left, top] = [x + letters / 2, y + 1.5 * letters];
    written.push({ left, top, width: ctx.measureText(text).width });
    ctx.lineWidth = 3;
    ctx.strokeStyle = colours.halo;
    ctx.strokeText(text, left, top);
    ctx.fillStyle = colours[COLOURS[served?.state ?? 'served']];
    ctx.fillText(text, left, top);
  }
}

/** The regions as a list. */
export function Regions() {
  const regions = rows.value?.regions;
  if (!regions?.length) return null;
  return html`<section aria-label="Regions">
    <h2>Regions <span class="count">${regions.length}</span></h2>
    <ul class="rows">${regions.map((region) => html`<li class="row"><span></span><span class="what">${region.name}</span>
      <span class="state"><span class=${region.state === 'served' ? '' : 'low'}>${region.text}</span>
        ${region.is_returnable && !isPast.value && html`<button type="button" key="give-back" disabled=${!maySteer.value || !maySupervise.value}
          onClick=${() => act('give_back', { region: region.name })}>Give ${region.name} back</button>`}</span></li>`)}</ul>
  </section>`;
}
