/** Field of view of a robot's camera on the plan: a cone clipped by walls. */

const RAYS = 48;
const MAX_M = 12;

/**
 * Computes fields of view from nearby walls only; reuses the outline of a robot that stands still.
 *
 * @typedef {{path: Path2D, reach: number}} Outline
 */
export class Sight {
  /** @param {number[][]} walls */
  constructor(walls) {
    this.walls = walls;
    /** @type {Map<number, {x: number, y: number, heading: number, outline: Outline}>} */
    this.known = new Map();
  }

  /**
   * @param {number} robot
   * @param {import('./tracks.js').Place} eye
   * @param {{field_of_view_deg: number, range_m: number}} camera
   * @returns {Outline}
   */
  outline(robot, { x, y, heading }, camera) {
    const known = this.known.get(robot);
    if (known?.x === x && known.y === y && known.heading === heading) return known.outline;
    const outline = this.look({ x, y, heading }, camera);
    this.known.set(robot, { x, y, heading, outline });
    return outline;
  }

  /**
   * @param {{x: number, y: number, heading: number}} eye
   * @param {{field_of_view_deg: number, range_m: number}} camera
   */
  look(eye, camera) {
    const reach = Math.min(MAX_M, camera.range_m);
    const near = this.walls.filter((wall) => isNear(wall, eye, reach));
    const wide = (camera.field_of_view_deg * Math.PI) / 180;
    const path = new Path2D();
    path.moveTo(eye.x, eye.y);
    for (let n = 0; n <= RAYS; n += 1) {
      const angle = eye.heading + wide * (n / RAYS - 0.5);
      const [dx, dy] = [Math.cos(angle), Math.sin(angle)];
      const far = near.reduce((least, wall) => Math.min(least, hit(eye, dx, dy, wall)), reach);
      path.lineTo(eye.x + far * dx, eye.y + far * dy);
    }
    path.closePath();
    return { path, reach };
  }
}

/**
 * @param {number[]} wall
 * @param {{x: number, y: number}} eye
 * @param {number} reach
 */
function isNear([x1, y1, x2, y2], { x, y }, reach) {
  return (
    Math.max(x1, x2) > x - reach &&
    Math.min(x1, x2) < x + reach &&
    Math.max(y1, y2) > y - reach &&
    Math.min(y1, y2) < y + reach
  );
}

/**
 * Length of a ray up to a wall.
 * @param {{x: number, y: number}} eye
 * @param {number} dx
 * @param {number} dy
 * @param {number[]} wall
 */
function hit(eye, dx, dy, [x1, y1, x2, y2]) {
  const [ex, ey] = [x2 - x1, y2 - y1];
  const cross = dx * ey - dy * ex;
  if (Math.abs(cross) < 1e-9) return Infinity;
  const far = ((x1 - eye.x) * ey - (y1 - eye.y) * ex) / cross;
  const along = ((x1 - eye.x) * dy - (y1 - eye.y) * dx) / cross;
  return far > 0 && along >= 0 && along <= 1 ? far : Infinity;
}
