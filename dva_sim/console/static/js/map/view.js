/**
 * Map view: Leaflet pans and zooms, and canvases over it draw.
 *
 * Each view has one affine transform. Static layers are redrawn when the view changes, moving ones
 * when something has moved. No moving thing is a Leaflet object.
 */
import '../../vendor/leaflet.js';

const L = /** @type {any} */ (globalThis).L;
const MAX_PIXELS = 2;
const MOVING_MS = 30; // what moves less than a pixel meanwhile is drawn every second frame
const ROOM = 0.03;

/** Transform from metres to pixels of the map's box. */
export class Affine {
  constructor() {
    this.scale = 1;
    this.left = this.top = 0;
    this.dpr = 1;
    this.width = this.height = 0;
  }

  /**
   * @param {number} x
   * @param {number} y
   * @returns {[number, number]}
   */
  pixel(x, y) {
    return [this.left + x * this.scale, this.top - y * this.scale];
  }

  /**
   * @param {number} left
   * @param {number} top
   * @returns {[number, number]}
   */
  metres(left, top) {
    return [(left - this.left) / this.scale, (this.top - top) / this.scale];
  }

  /** @param {CanvasRenderingContext2D} ctx */
  toMetres(ctx) {
    const s = this.scale * this.dpr;
    ctx.setTransform(s, 0, 0, -s, this.left * this.dpr, this.top * this.dpr);
  }

  /** @param {CanvasRenderingContext2D} ctx */
  toPixels(ctx) {
    ctx.setTransform(this.dpr, 0, 0, this.dpr, 0, 0);
  }
}

/**
 * @typedef {{draw: (ctx: CanvasRenderingContext2D, affine: Affine, now: number) => void,
 *   isMoving: (now: number) => boolean}} Scenery
 */

export class MapView {
  /**
   * @param {HTMLElement} element
   * @param {number[]} extent [xmin, ymin, xmax, ymax]
   * @param {Scenery[]} sceneries from the ground up; each has a canvas of its own
   * @param {{keyboard: boolean}} options
   */
  constructor(element, extent, sceneries, options) {
    this.element = element;
    this.extent = extent;
    this.affine = new Affine();
    this.parts = sceneries.map((scenery) => ({ scenery, canvas: addCanvas(element), drawn: 0 }));
    this.stale = sceneries.map(() => true);
    this.follow = /** @type {(() => [number, number] | null) | null} */ (null);
    this.map = L.map(element, {
      crs: L.CRS.Simple,
      zoomControl: false,
      attributionControl: false,
      zoomAnimation: false,
      fadeAnimation: false,
      markerZoomAnimation: false,
      inertia: false,
      zoomSnap: 0,
      zoomDelta: 0.5,
      wheelPxPerZoomLevel: 90,
      wheelDebounceTime: 16,
      minZoom: -4,
      maxZoom: 8,
      keyboard: options.keyboard,
      boxZoom: false,
    });
    this.listen();
    this.fit();
  }

  listen() {
    this.map.on('move zoom resize viewreset', () => this.viewChanged());
    this.map.on('dragstart', () => (this.follow = null));
    this.sizes = new ResizeObserver(() => {
      this.map.invalidateSize({ animate: false, pan: false });
      if (!this.moved) this.fit();
      this.viewChanged();
    });
    this.sizes.observe(this.element);
    this.map.on('dragstart zoomstart', () => (this.moved = this.settled));
    this.settled = false;
    this.moved = false;
    this.frame = requestAnimationFrame((now) => this.tick(now));
  }

  /** Show the whole site. */
  fit() {
    const [xmin, ymin, xmax, ymax] = this.extent;
    const rim = ROOM * Math.max(xmax - xmin, ymax - ymin);
    this.settled = false;
    this.map.fitBounds(
      [
        [ymin - rim, xmin - rim],
        [ymax + rim, xmax + rim],
      ],
      { animate: false },
    );
    this.settled = true;
    this.moved = false;
  }

  /** @param {number} steps */
  zoom(steps) {
    this.map.setZoom(this.map.getZoom() + steps, { animate: false });
  }

  viewChanged() {
    const size = this.map.getSize();
    const zero = this.map.latLngToContainerPoint([0, 0]);
    const dpr = Math.min(MAX_PIXELS, window.devicePixelRatio || 1);
    const scale = this.map.getZoomScale(this.map.getZoom(), 0);
    Object.assign(this.affine, { scale, left: zero.x, top: zero.y, dpr });
    Object.assign(this.affine, { width: size.x, height: size.y });
    this.stale.fill(true);
  }

  /**
   * Draw a layer again, though nothing on it has moved.
   * @param {number} layer
   */
  refresh(layer) {
    this.stale[layer] = true;
  }

  /** @param {number} now */
  tick(now) {
    this.frame = requestAnimationFrame((later) => this.tick(later));
    this.goAlong();
    this.parts.forEach((part, n) => {
      const moves = now - part.drawn >= MOVING_MS && part.scenery.isMoving(now);
      if (!this.stale[n] && !moves) return;
      this.stale[n] = false;
      part.drawn = now;
      this.draw(part, now);
    });
  }

  goAlong() {
    const place = this.follow?.();
    if (!place) return;
    const centre = this.map.getCenter();
    const far = Math.hypot(centre.lng - place[0], centre.lat - place[1]) * this.affine.scale;
    if (far > 0.5) this.map.setView([place[1], place[0]], this.map.getZoom(), { animate: false });
  }

  /**
   * @param {{scenery: Scenery, canvas: HTMLCanvasElement}} part
   * @param {number} now
   */
  draw({ scenery, canvas }, now) {
    const { width, height, dpr } = this.affine;
    if (canvas.width !== Math.round(width * dpr) || canvas.height !== Math.round(height * dpr)) {
      canvas.width = Math.round(width * dpr);
      canvas.height = Math.round(height * dpr);
    }
    const ctx = /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d'));
    ctx.setTransform(1, 0, 0, 1, 0, 0);
    ctx.clearRect(0, 0, canvas.width, canvas.height);
    scenery.draw(ctx, this.affine, now);
  }

  /** @param {MouseEvent} event */
  place(event) {
    const box = this.element.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  /**
   * Bring a place into view, if it is not.
   * @param {number} x
   * @param {number} y
   */
  reveal(x, y) {
    if (!this.map.getBounds().pad(-0.05).contains([y, x])) {
      this.map.panTo([y, x], { animate: false });
    }
  }

  remove() {
    cancelAnimationFrame(this.frame ?? 0);
    this.sizes?.disconnect();
    this.map.remove();
    for (const part of this.parts) part.canvas.remove();
  }
}

/** @param {HTMLElement} element */
function addCanvas(element) {
  const canvas = document.createElement('canvas');
  canvas.className = 'map-canvas';
  canvas.setAttribute('aria-hidden', 'true');
  element.append(canvas);
  return canvas;
}
