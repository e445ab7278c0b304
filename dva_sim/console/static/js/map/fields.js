/** Hazards as fields over the floor: a veil of smoke, gas, water, heat; below all symbols. */
import { rgb } from './plan.js';

/** Colour and largest opacity of each kind of field. */
const LOOKS = /** @type {Record<string, {colour: string, most: number}>} */ ({
  smoke: { colour: 'smoke', most: 0.6 },
  gas: { colour: 'gas', most: 0.55 },
  water: { colour: 'water', most: 0.6 },
  heat: { colour: 'fire', most: 0.5 },
});
const ORDER = ['water', 'gas', 'heat', 'smoke'];

export class Fields {
  constructor() {
    /** @type {{field: import('../lines.js').Field, picture: HTMLCanvasElement}[]} */
    this.pictures = [];
  }

  /**
   * @param {import('../lines.js').Field[]} fields
   * @param {Record<string, string>} colours
   */
  update(fields, colours) {
    this.pictures = [...fields]
      .sort((a, b) => ORDER.indexOf(a.kind) - ORDER.indexOf(b.kind))
      .map((field) => ({ field, picture: paint(field, colours) }));
  }

  /** Return false: fields change only with a new message. */
  isMoving() {
    return false;
  }

  /**
   * @param {CanvasRenderingContext2D} ctx
   * @param {import('./view.js').Affine} affine
   */
  draw(ctx, affine) {
    affine.toMetres(ctx);
    ctx.imageSmoothingEnabled = true;
    for (const { field, picture } of this.pictures) {
      const { x0_m, y0_m, cell_m, columns, rows } = field;
      ctx.drawImage(picture, x0_m, y0_m, columns * cell_m, rows * cell_m);
    }
    affine.toPixels(ctx);
  }
}

/**
 * @param {import('../lines.js').Field} field
 * @param {Record<string, string>} colours
 */
function paint(field, colours) {
  const canvas = document.createElement('canvas');
  canvas.width = field.columns;
  canvas.height = field.rows;
  const ctx = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d'));
  const image = ctx.createImageData(field.columns, field.rows);
  const cells = atob(field.cells);
  const look = LOOKS[field.kind] ?? LOOKS.smoke;
  const [red, green, blue] = rgb(colours[look.colour]);
  for (let n = 0; n < cells.length; n += 1) {
    const full = Math.sqrt(cells.charCodeAt(n) / 255);
    image.data.set([red, green, blue, 255 * look.most * full], 4 * n);
  }
  ctx.putImageData(image, 0, 0);
  return canvas;
}
