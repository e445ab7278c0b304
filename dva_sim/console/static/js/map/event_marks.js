/** Events on the map: shape and colour show the severity, a number and a label the event and its state. */
import { selection } from '../store.js';
import { worldNow } from '../net/world_time.js';
import { ageText } from '../ui/words.js';
import { lettersOn } from './lettering.js';
import { SEVERITIES } from './marks.js';
import { isOpen } from './shown.js';

export const EVENT_PX = 18;
/** Height of an event's mark above its place [px]. */
export const EVENT_UP_PX = 22;

/** @typedef {import('./bodies.js').Pen} Pen */

/**
 * Draw an event, and return where its label stands.
 * @param {Pen} pen
 * @param {import('../lines.js').SiteEvent} event
 */
export function drawEvent(pen, event) {
  const { ctx, affine, colours: palette } = pen;
  const [left, top] = affine.pixel(event.x_m, event.y_m);
  const chosen = selection.peek();
  const mine = chosen?.kind === 'event' && chosen.key === event.number;
  if (mine) ring(pen, left, top - EVENT_UP_PX, 15);
  ctx.globalAlpha = isOpen(event) ? 1 : 0.55;
  const s = EVENT_PX * affine.dpr;
  ctx.setTransform(s, 0, 0, s, left * affine.dpr, (top - EVENT_UP_PX) * affine.dpr);
  const shape = SEVERITIES[event.severity] ?? SEVERITIES.low;
  ctx.lineWidth = 3 / EVENT_PX;
  ctx.strokeStyle = palette.halo;
  ctx.stroke(shape);
  ctx.fillStyle = palette[event.severity] ?? palette.card;
  ctx.fill(shape);
  ctx.lineWidth = 1.5 / EVENT_PX;
  ctx.strokeStyle = palette.outline;
  ctx.stroke(shape);
  affine.toPixels(ctx);
  number(ctx, palette[`on-${event.severity}`] ?? palette.ink, event.number, left, top - EVENT_UP_PX);
  const age = isOpen(event) || mine ? ` ${ageText(worldNow() - event.since_ms)}` : '';
  const words = `${event.state}${age}`;
  const start = left + EVENT_PX / 2 + 4;
  label(ctx, palette, words, start, top - EVENT_UP_PX, 'left');
  ctx.globalAlpha = 1;
  const bottom = top - EVENT_UP_PX + lettersOn(ctx) / 2;
  return { left: start, top: bottom, width: ctx.measureText(words).width };
}

/**
 * @param {Pen} pen
 * @param {number} left
 * @param {number} top
 * @param {number} radius
 */
export function ring({ ctx, colours: palette }, left, top, radius) {
  ctx.beginPath();
  ctx.arc(left, top, radius, 0, 2 * Math.PI);
  ctx.lineWidth = 2.5;
  ctx.strokeStyle = palette.focus;
  ctx.stroke();
}

/**
 * @param {CanvasRenderingContext2D} ctx
 * @param {string} colour
 * @param {number} value
 * @param {number} left
 * @param {number} top
 */
function number(ctx, colour, value, left, top) {
  ctx.font = '600 10px system-ui, sans-serif';
  ctx.textAlign = 'center';
  ctx.textBaseline = 'middle';
  ctx.fillStyle = colour;
  ctx.fillText(String(value), left, top + 1);
}

/**
 * @param {CanvasRenderingContext2D} ctx
 * @param {Record<string, string>} palette
 * @param {string} text
 * @param {number} left
 * @param {number} top
 * @param {CanvasTextAlign} align
 */
export function label(ctx, palette, text, left, top, align) {
  ctx.font = `${lettersOn(ctx)}px system-ui, sans-serif`;
  ctx.textAlign = align;
  ctx.textBaseline = 'middle';
  ctx.lineJoin = 'round';
  ctx.lineWidth = 3;
  ctx.strokeStyle = palette.halo;
  ctx.strokeText(text, left, top);
  ctx.fillStyle = palette.ink;
  ctx.fillText(text, left, top);
}
