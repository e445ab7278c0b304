/** Robots and people from above, with position, heading and mode. */
import { modeOf, rowOf } from '../store.js';
import { isFree, lettersOn } from './lettering.js';
import { MODES, PERSON, ROBOT } from './marks.js';

const LARGER = 1.25; // bodies are drawn a little larger than they are
const MIN_PX = /** @type {Record<string, number>} */ ({ robot: 15, guard: 13, bystander: 7 });
const BATTERY = { width: 16, height: 3, low: 0.25 };
const MANY = 40;

/** @type {Record<string, string>} */
const MODE_COLOURS = {
  Idle: 'idle',
  Mission: 'mission',
  Teleoperation: 'teleoperation',
  Manual: 'manual',
  Emergency: 'emergency',
  Lost: 'link-lost',
};

/** @param {string} mode */
export const modeColour = (mode) => MODE_COLOURS[mode] ?? 'idle';

/**
 * Diameter on the map [px]: true to scale, but never too small to see.
 * @param {import('../lines.js').Thing} thing
 * @param {number} scale
 */
export function sizeOf(thing, scale) {
  return Math.max(2 * LARGER * (thing.radius_m ?? 0) * scale, MIN_PX[thing.kind] ?? 9);
}

/**
 * @typedef {{ctx: CanvasRenderingContext2D, affine: import('./view.js').Affine,
 *   colours: Record<string, string>}} Pen
 * @typedef {{thing: import('../lines.js').Thing, left: number, top: number,
 *   heading: number, size: number}} Body
 */

/**
 * @param {Pen} pen
 * @param {Body} body
 */
export function drawPerson({ ctx, affine, colours }, body) {
  const guard = body.thing.kind === 'guard';
  place(ctx, affine, body);
  ctx.fillStyle = colours[guard ? 'guard' : 'bystander'];
  ctx.fill(PERSON);
  ctx.lineWidth = (guard ? 1.5 : 1) / body.size;
  ctx.strokeStyle = guard ? colours.outline : colours.halo;
  ctx.stroke(PERSON);
  affine.toPixels(ctx);
}

/**
 * @param {Pen} pen
 * @param {Body} body
 */
export function drawRobot({ ctx, affine, colours }, body) {
  const mode = modeOf(body.thing.i);
  place(ctx, affine, body);
  ctx.lineJoin = 'round';
  ctx.lineWidth = 4.5 / body.size;
  ctx.strokeStyle = colours.halo;
  ctx.stroke(ROBOT);
  ctx.fillStyle = colours[modeColour(mode)];
  ctx.fill(ROBOT);
  ctx.lineWidth = 1.5 / body.size;
  ctx.strokeStyle = colours.outline;
  ctx.stroke(ROBOT);
  drawGlyph(ctx, MODES[mode], colours.halo);
  affine.toPixels(ctx);
}

/**
 * @param {CanvasRenderingContext2D} ctx
 * @param {Path2D | undefined} glyph
 * @param {string} colour
 */
function drawGlyph(ctx, glyph, colour) {
  if (!glyph) return;
  ctx.lineWidth = 0.14;
  ctx.lineCap = 'round';
  ctx.strokeStyle = colour;
  ctx.stroke(glyph);
}

/**
 * @param {CanvasRenderingContext2D} ctx
 * @param {import('./view.js').Affine} affine
 * @param {Body} body
 */
function place(ctx, affine, { left, top, heading, size }) {
  const s = size * affine.dpr;
  const [cos, sin] = [Math.cos(heading), Math.sin(heading)];
  ctx.setTransform(s * cos, -s * sin, s * sin, s * cos, left * affine.dpr, top * affine.dpr);
}

/**
 * Draw the battery charge below the robot; without `always` only if it is low.
 * @param {Pen} pen
 * @param {Body} body
 * @param {boolean} always
 */
export function drawBattery({ ctx, colours }, body, always) {
  const share = rowOf(body.thing.i)?.battery;
  if (share === null || share === undefined) return;
  const low = share < BATTERY.low;
  if (!always && !low) return;
  const left = body.left - BATTERY.width / 2;
  const top = body.top + body.size / 2 + 6;
  ctx.fillStyle = colours.halo;
  ctx.fillRect(left - 1, top - 1, BATTERY.width + 2, BATTERY.height + 2);
  ctx.fillStyle = colours.line;
  ctx.fillRect(left, top, BATTERY.width, BATTERY.height);
  ctx.fillStyle = low ? colours.warning : colours.soft;
  ctx.fillRect(left, top, BATTERY.width * share, BATTERY.height);
}

/**
 * Draw the name above a body, or below it if another name is in the way; else not at all.
 * @param {Pen} pen
 * @param {Body} body
 * @param {boolean} strong
 * @param {import('./lettering.js').Place[]} written
 */
export function drawName({ ctx, colours }, body, strong, written) {
  const letters = lettersOn(ctx);
  ctx.font = `${strong ? 600 : 400} ${letters}px system-ui, sans-serif`;
  ctx.textAlign = 'center';
  ctx.textBaseline = 'bottom';
  ctx.lineJoin = 'round';
  ctx.lineWidth = 3;
  ctx.strokeStyle = colours.halo;
  ctx.fillStyle = colours.ink;
  const width = ctx.measureText(body.thing.label).width;
  const above = body.top - 0.6 * body.size - 3;
  const below = body.top + 0.6 * body.size + letters + 10;
  const left = body.left - width / 2;
  const top = [above, below].find((y) => strong || isFree(written, { left, top: y, width }, letters));
  if (top === undefined) return;
  written.push({ left, top, width });
  ctx.strokeText(body.thing.label, body.left, top);
  ctx.fillText(body.thing.label, body.left, top);
}

/**
 * True if all names can be read: few robots, or a large scale.
 * @param {number} count
 * @param {number} scale
 */
export const isRoomy = (count, scale) => count <= MANY || scale > 24;
