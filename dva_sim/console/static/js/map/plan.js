/** Static parts of the map: floors, walls, doors, exits and names; in metres, y up. */
import { DARK, LIGHT } from '../palette.js';
import { isFree, lettersOn } from './lettering.js';

const WALL_M = 0.14;
const MIN_PX = 30;

/** @typedef {{path: Path2D, colour: string}} Floor */

/**
 * The plan as paths, built once per scene.
 */
export class Plan {
  /** @param {import('../lines.js').Site} site */
  constructor(site) {
    this.site = site;
    const rooms = [...site.rooms].sort((a, b) => Number(b.outdoor) - Number(a.outdoor));
    /** @type {Floor[]} */
    this.floors = rooms.map((room) => ({
      path: union([room.polygon_m, ...room.holes_m].map(ring)),
      colour: room.floor,
    }));
    this.solids = union(site.solids_m.map(ring));
    this.walls = lines(site.walls_m);
    this.doors = lines(site.doors_m);
    this.exits = lines(site.exits_m);
    this.names = rooms.map((room) => ({ name: room.name, ...middle(room.polygon_m) }));
    this.picture = site.raster ? rasterPicture(site.raster) : null;
  }

  /**
   * @param {CanvasRenderingContext2D} ctx
   * @param {import('./view.js').Affine} affine
   * @param {Record<string, string>} colours
   */
  draw(ctx, affine, colours) {
    affine.toMetres(ctx);
    if (this.site.raster) this.drawRaster(ctx, colours);
    const dark = colours.page === DARK.page;
    for (const floor of this.floors) {
      ctx.fillStyle = dark ? darker(floor.colour) : floor.colour;
      ctx.fill(floor.path, 'evenodd');
    }
    this.drawSolids(ctx, affine, colours);
    this.drawWalls(ctx, affine, colours);
    affine.toPixels(ctx);
  }

  /**
   * @param {CanvasRenderingContext2D} ctx
   * @param {import('./view.js').Affine} affine
   * @param {Record<string, string>} colours
   */
  drawSolids(ctx, affine, colours) {
    ctx.lineWidth = 1 / affine.scale;
    ctx.fillStyle = colours.solid;
    ctx.strokeStyle = colours['solid-edge'];
    ctx.fill(this.solids);
    ctx.stroke(this.solids);
  }

  /**
   * @param {CanvasRenderingContext2D} ctx
   * @param {import('./view.js').Affine} affine
   * @param {Record<string, string>} colours
   */
  drawWalls(ctx, affine, colours) {
    const width = Math.max(WALL_M, 1 / affine.scale);
    ctx.lineCap = 'square';
    /** @type {[Path2D, string, number][]} */
    const strokes = [
      [this.doors, colours.door, width / 2],
      [this.walls, colours.wall, width],
      [this.exits, colours.exit, 2 * width],
    ];
    for (const [path, colour, wide] of strokes) {
      ctx.strokeStyle = colour;
      ctx.lineWidth = wide;
      ctx.stroke(path);
    }
  }

  /**
   * Draw room names where they fit, and give way to other words; zooming in shows the others.
   * @param {import('./bodies.js').Pen} pen
   * @param {import('./lettering.js').Place[]} written
   */
  drawNames({ ctx, affine, colours }, written) {
    affine.toPixels(ctx);
    const letters = lettersOn(ctx);
    ctx.font = `${letters}px system-ui, sans-serif`;
    ctx.textAlign = 'center';
    ctx.textBaseline = 'middle';
    ctx.fillStyle = colours['room-name'];
    for (const { name, x, y, width, height } of this.names) {
      const wide = width * affine.scale;
      if (wide < MIN_PX || height * affine.scale < 2 * letters) continue;
      const [left, top] = affine.pixel(x, y);
      for (const text of [name, name.replace(/^\D+(?=\d)/, '')]) {
        const textWidth = ctx.measureText(text).width;
        if (textWidth > wide - 8) continue;
        const place = { left: left - textWidth / 2, top: top + letters / 2, width: textWidth };
        if (isFree(written, place, letters)) ctx.fillText(text, left, top);
        break;
      }
    }
  }

  /**
   * @param {CanvasRenderingContext2D} ctx
   * @param {Record<string, string>} colours
   */
  drawRaster(ctx, colours) {
    const raster = /** @type {import('../lines.js').Raster} */ (this.site.raster);
    const picture = this.picture?.(colours);
    if (!picture) return;
    ctx.save();
    ctx.translate(raster.x0_m, raster.y0_m);
    ctx.rotate(raster.heading_rad ?? 0);
    ctx.imageSmoothingEnabled = false;
    ctx.drawImage(picture, 0, 0, raster.columns * raster.cell_m, raster.rows * raster.cell_m);
    ctx.restore();
  }
}

/** @param {number[][]} points */
function ring(points) {
  const path = new Path2D();
  points.forEach(([x, y], n) => (n ? path.lineTo(x, y) : path.moveTo(x, y)));
  path.closePath();
  return path;
}

/** @param {Path2D[]} paths */
function union(paths) {
  const all = new Path2D();
  for (const path of paths) all.addPath(path);
  return all;
}

/** @param {number[][]} ends */
function lines(ends) {
  const path = new Path2D();
  for (const [x1, y1, x2, y2] of ends) {
    path.moveTo(x1, y1);
    path.lineTo(x2, y2);
  }
  return path;
}

/** @param {number[][]} points */
function middle(points) {
  const xs = points.map((point) => point[0]);
  const ys = points.map((point) => point[1]);
  const [left, right] = [Math.min(...xs), Math.max(...xs)];
  const [low, high] = [Math.min(...ys), Math.max(...ys)];
  return { x: (left + right) / 2, y: (low + high) / 2, width: right - left, height: high - low };
}

/** @type {Map<string, string>} */
const DARKER = new Map(
  Object.entries(LIGHT).map(([name, colour]) => [
    colour,
    /** @type {Record<string, string>} */ (DARK)[name],
  ]),
);

/**
 * Dark counterpart of a light floor colour.
 * @param {string} colour
 */
function darker(colour) {
  return DARKER.get(colour.toLowerCase()) ?? DARK['floor-0'];
}

/**
 * The cells of a bare map, painted once for each theme.
 * @param {import('../lines.js').Raster} raster
 */
function rasterPicture(raster) {
  const bits = Uint8Array.from(atob(raster.cells), (c) => c.charCodeAt(0));
  /** @type {Map<string, HTMLCanvasElement>} */
  const made = new Map();
  return (/** @type {Record<string, string>} */ colours) => {
    const known = made.get(colours.page);
    if (known) return known;
    const picture = paint(raster, bits, colours);
    made.set(colours.page, picture);
    return picture;
  };
}

/**
 * @param {import('../lines.js').Raster} raster
 * @param {Uint8Array} bits
 * @param {Record<string, string>} colours
 */
function paint(raster, bits, colours) {
  const canvas = document.createElement('canvas');
  canvas.width = raster.columns;
  canvas.height = raster.rows;
  const ctx = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d'));
  const image = ctx.createImageData(raster.columns, raster.rows);
  const [wall, floor] = [rgb(colours.wall), rgb(colours['map-floor'])];
  for (let n = 0; n < raster.columns * raster.rows; n += 1) {
    const solid = (bits[n >> 3] >> (7 - (n & 7))) & 1;
    image.data.set([...(solid ? wall : floor), 255], 4 * n);
  }
  ctx.putImageData(image, 0, 0);
  return canvas;
}

/**
 * @param {string} colour as #rrggbb
 */
export function rgb(colour) {
  return [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16));
}
