/** Moving and changing parts of the map: hazards, events, trails, robots, people. */
import { events, hazards, modeOf, robots, scene, selection, tracks } from '../store.js';
import { HAZARDS } from '../palette.js';
import { colours } from '../shell/theme.js';
import { drawBattery, drawName, drawPerson, drawRobot, isRoomy, modeColour, sizeOf } from './bodies.js';
import { Sight } from './cone.js';
import { drawEvent, EVENT_PX, EVENT_UP_PX, label, ring } from './event_marks.js';
import { SOURCES, stateColour } from './marks.js';
import { isOpen, thingsOf } from './shown.js';

const HIT_PX = 12;
const EVERY_SECOND = 1000;

/** @typedef {import('./bodies.js').Pen} Pen */
/** @typedef {(pen: Pen, written: import('./lettering.js').Place[]) => void} Draw */
/** @typedef {import('./bodies.js').Body} Body */

export class Live {
  /**
   * @param {import('./plan.js').Plan} ground
   * @param {{cones: () => number[], goals: () => import('../types.js').Goal[],
   *   ways: () => number[][][], under: Draw}} options robots whose cone of sight is drawn, goals,
   *   routes to follow [m], what is drawn first
   */
  constructor(ground, { cones, goals, ways, under }) {
    this.ground = ground;
    this.cones = cones;
    this.goals = goals;
    this.ways = ways;
    this.under = under;
    this.sight = new Sight(scene.peek()?.site.walls_m ?? []);
    /** @type {Body[]} */
    this.bodies = [];
    /** @type {import('./lettering.js').Place[]} */
    this.written = [];
    this.second = 0;
  }

  /** @param {number} now */
  isMoving(now) {
    const second = Math.floor(now / EVERY_SECOND);
    const ticks = second !== this.second && events.peek().some((event) => isOpen(event));
    return ticks || tracks.isMoving(now);
  }

  /**
   * @param {CanvasRenderingContext2D} ctx
   * @param {import('./view.js').Affine} affine
   * @param {number} now
   */
  draw(ctx, affine, now) {
    this.second = Math.floor(now / EVERY_SECOND);
    const pen = { ctx, affine, colours: colours.peek() };
    this.bodies = placed(affine, now);
    this.ground.drawNames(pen, this.written); // as it was written last
    this.written = [];
    this.under(pen, this.written);
    this.drawCones(pen, now);
    this.drawTrails(pen);
    this.drawWays(pen);
    this.drawGoals(pen);
    this.drawOrders(pen);
    this.drawSources(pen);
    this.drawBodies(pen);
    for (const event of events.peek()) this.written.push(drawEvent(pen, event));
  }

  /**
   * @param {Pen} pen
   * @param {number} now
   */
  drawCones({ ctx, affine, colours: palette }, now) {
    affine.toMetres(ctx);
    for (const i of this.cones()) {
      const camera = robots.peek().find((robot) => robot.i === i)?.camera;
      const eye = tracks.place(i, now);
      if (!camera || !eye) continue;
      const { path, reach } = this.sight.outline(i, eye, camera);
      const fade = ctx.createRadialGradient(eye.x, eye.y, 0, eye.x, eye.y, reach);
      const colour = palette[modeColour(modeOf(i))];
      fade.addColorStop(0, `${colour}66`);
      fade.addColorStop(1, `${colour}0a`);
      ctx.fillStyle = fade;
      ctx.fill(path);
    }
    affine.toPixels(ctx);
  }

  /** @param {Pen} pen */
  drawTrails({ ctx, affine, colours: palette }) {
    affine.toMetres(ctx);
    ctx.lineWidth = 2 / affine.scale;
    ctx.lineCap = ctx.lineJoin = 'round';
    ctx.globalAlpha = 0.55;
    for (const { thing } of this.bodies) {
      if (thing.kind !== 'robot') continue;
      const path = new Path2D();
      tracks.last(thing.i)?.trace(path);
      ctx.strokeStyle = palette[modeColour(modeOf(thing.i))];
      ctx.stroke(path);
    }
    ctx.globalAlpha = 1;
    affine.toPixels(ctx);
  }

  /** @param {Pen} pen */
  drawWays({ ctx, affine, colours: palette }) {
    ctx.lineWidth = 4;
    ctx.lineCap = ctx.lineJoin = 'round';
    ctx.strokeStyle = palette.focus;
    for (const way of this.ways()) {
      ctx.beginPath();
      for (const [x, y] of way) ctx.lineTo(...affine.pixel(x, y));
      ctx.stroke();
    }
  }

  /** @param {Pen} pen */
  drawGoals({ ctx, affine, colours: palette }) {
    for (const { x, y, radius, name } of this.goals()) {
      const [left, top] = affine.pixel(x, y);
      const size = Math.max(10, radius * affine.scale);
      ctx.beginPath();
      ctx.arc(left, top, size, 0, 2 * Math.PI);
      ctx.fillStyle = `${palette.focus}33`;
      ctx.fill();
      ctx.setLineDash([6, 4]);
      ctx.lineWidth = 2;
      ctx.strokeStyle = palette.focus;
      ctx.stroke();
      ctx.setLineDash([]);
      label(ctx, palette, name, left, top - size - 10, 'center');
    }
  }

  /**
   * Draw a line from each assigned responder to its event.
   * @param {Pen} pen
   */
  drawOrders({ ctx, affine, colours: palette }) {
    const byLabel = new Map(this.bodies.map((body) => [body.thing.label, body]));
    ctx.lineWidth = 1.5;
    ctx.setLineDash([2, 4]);
    for (const event of events.peek()) {
      if (!isOpen(event)) continue;
      ctx.strokeStyle = palette[stateColour(event.state)] ?? palette.ink;
      const [left, top] = affine.pixel(event.x_m, event.y_m);
      for (const body of event.assigned.map((name) => byLabel.get(name))) {
        if (!body) continue;
        ctx.beginPath();
        ctx.moveTo(body.left, body.top);
        ctx.lineTo(left, top);
        ctx.stroke();
      }
    }
    ctx.setLineDash([]);
  }

  /** @param {Pen} pen */
  drawSources({ ctx, affine, colours: palette }) {
    const looks = /** @type {Record<string, {mark: string, colour: string}>} */ (HAZARDS);
    for (const hazard of hazards.peek().hazards) {
      const look = looks[hazard.kind] ?? { mark: 'X', colour: palette.warning };
      const [left, top] = affine.pixel(hazard.x_m, hazard.y_m);
      const s = 18 * affine.dpr;
      ctx.setTransform(s, 0, 0, s, left * affine.dpr, top * affine.dpr);
      ctx.globalAlpha = hazard.contained ? 0.45 : 1;
      ctx.lineWidth = 0.1;
      ctx.fillStyle = look.colour;
      ctx.strokeStyle = palette.outline;
      ctx.fill(SOURCES[look.mark] ?? SOURCES.X);
      ctx.stroke(SOURCES[look.mark] ?? SOURCES.X);
      ctx.globalAlpha = 1;
    }
    affine.toPixels(ctx);
  }

  /** @param {Pen} pen */
  drawBodies(pen) {
    const chosen = selection.peek();
    const machines = this.bodies.filter((body) => body.thing.kind === 'robot');
    const roomy = isRoomy(machines.length, pen.affine.scale);
    for (const body of this.bodies) {
      const mine = chosen?.kind === 'thing' && chosen.key === body.thing.i;
      if (mine) ring(pen, body.left, body.top, body.size / 2 + 7);
      if (body.thing.kind !== 'robot') drawPerson(pen, body);
    }
    for (const body of machines) drawRobot(pen, body);
    for (const body of machines) drawBattery(pen, body, roomy);
    for (const body of [...machines, ...this.bodies.filter((one) => one.thing.kind !== 'robot')]) {
      const mine = chosen?.kind === 'thing' && chosen.key === body.thing.i;
      const named = body.thing.kind !== 'bystander' && roomy;
      if (named || mine) drawName(pen, body, mine, this.written);
    }
  }

  /**
   * Find the nearest thing or event within reach of a point of the map [px].
   * @param {number} left
   * @param {number} top
   * @param {import('./view.js').Affine} affine
   * @returns {import('../types.js').Selection}
   */
  hit(left, top, affine) {
    let best = /** @type {import('../types.js').Selection} */ (null);
    let least = Infinity;
    const offer = (/** @type {number} */ far, /** @type {number} */ reach, /** @type {any} */ what) => {
      if (far < reach && far < least) [least, best] = [far, what];
    };
    for (const body of this.bodies) {
      const far = Math.hypot(body.left - left, body.top - top);
      offer(far, HIT_PX + body.size / 2, { kind: 'thing', key: body.thing.i });
    }
    for (const event of events.peek()) {
      const [x, y] = affine.pixel(event.x_m, event.y_m);
      const far = Math.hypot(x - left, y - EVENT_UP_PX - top);
      offer(far, HIT_PX + EVENT_PX / 2, { kind: 'event', key: event.number });
    }
    return best;
  }
}

/**
 * @param {import('./view.js').Affine} affine
 * @param {number} now
 * @returns {Body[]}
 */
function placed(affine, now) {
  const bodies = [];
  for (const thing of thingsOf(['bystander', 'guard', 'robot'])) {
    const place = tracks.place(thing.i, now);
    if (!place) continue;
    const [left, top] = affine.pixel(place.x, place.y);
    const out = left < -40 || top < -40 || left > affine.width + 40 || top > affine.height + 40;
    if (out) continue;
    bodies.push({ thing, left, top, heading: place.heading, size: sizeOf(thing, affine.scale) });
  }
  return bodies;
}
