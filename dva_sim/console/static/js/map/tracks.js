/** Positions and trails of things: interpolated between messages, held after the last one. */

const GLIDE_MS = 100;
const POINTS = 40;
const STEP_MS = 500;
const STEP_M = 0.05;
const FAR_M = 5;

/**
 * @typedef {{x: number, y: number, heading: number, speed: number}} Place
 */

export class Tracks {
  constructor() {
    /** @type {Map<number, Track>} */
    this.all = new Map();
    this.changed = 0;
  }

  /**
   * @param {number[][]} list rows of [i, x_cm, y_cm, heading_mrad, speed_mm_s]
   * @param {number} now
   */
  put(list, now) {
    for (const [i, x, y, heading, speed] of list) {
      const track = this.all.get(i) ?? new Track();
      this.all.set(i, track);
      track.go(x / 100, y / 100, heading / 1000, speed / 1000, now);
    }
    this.changed = now;
  }

  /**
   * Forget all but these: the others have left the site.
   * @param {Set<number>} there
   */
  keep(there) {
    for (const i of this.all.keys()) if (!there.has(i)) this.all.delete(i);
  }

  /** Reset all tracks after a jump in time: nothing glides from its old position to the next one. */
  jump() {
    for (const track of this.all.values()) track.begin();
  }

  /** @param {number[]} gone */
  drop(gone) {
    for (const i of gone) this.all.delete(i);
  }

  /**
   * True while things still glide, so that a later picture would differ.
   * @param {number} now
   */
  isMoving(now) {
    return now - this.changed < GLIDE_MS + 20;
  }

  /**
   * @param {number} i
   * @param {number} now
   * @returns {Place | null}
   */
  place(i, now) {
    return this.all.get(i)?.at(now) ?? null;
  }

  /**
   * Track of a thing, with its last reported place.
   * @param {number | null} i
   */
  last(i) {
    return (i !== null && this.all.get(i)) || null;
  }
}

export class Track {
  constructor() {
    this.x = this.y = this.heading = this.speed = 0;
    this.fromX = this.fromY = this.fromHeading = 0;
    this.trail = new Float32Array(2 * POINTS);
    this.since = -1;
    this.length = this.next = 0;
    this.marked = 0;
  }

  /** Clear the trail, and do not glide to the next place. */
  begin() {
    this.since = -1;
    this.length = this.next = 0;
    this.marked = 0;
  }

  /**
   * @param {number} x
   * @param {number} y
   * @param {number} heading
   * @param {number} speed
   * @param {number} now
   */
  go(x, y, heading, speed, now) {
    const here = this.since < 0 ? { x, y, heading } : this.at(now);
    const jump = Math.abs(x - here.x) + Math.abs(y - here.y) > FAR_M;
    this.fromX = jump ? x : here.x;
    this.fromY = jump ? y : here.y;
    this.fromHeading = here.heading;
    Object.assign(this, { x, y, heading, speed, since: now });
    this.leaveMark(now);
  }

  /** @param {number} now */
  at(now) {
    const share = Math.min(1, Math.max(0, (now - this.since) / GLIDE_MS));
    return {
      x: this.fromX + share * (this.x - this.fromX),
      y: this.fromY + share * (this.y - this.fromY),
      heading: this.fromHeading + share * turn(this.fromHeading, this.heading),
      speed: this.speed,
    };
  }

  /** @param {number} now */
  leaveMark(now) {
    if (now - this.marked < STEP_MS && this.length) return;
    const last = 2 * ((this.next + POINTS - 1) % POINTS);
    const moved = Math.abs(this.x - this.trail[last]) + Math.abs(this.y - this.trail[last + 1]);
    if (this.length && moved < STEP_M) return;
    this.trail[2 * this.next] = this.x;
    this.trail[2 * this.next + 1] = this.y;
    this.next = (this.next + 1) % POINTS;
    this.length = Math.min(POINTS, this.length + 1);
    this.marked = now;
  }

  /**
   * Add the trail to a path, from the oldest point on.
   * @param {Path2D | CanvasRenderingContext2D} path
   */
  trace(path) {
    for (let n = 0; n < this.length; n += 1) {
      const at = 2 * ((this.next - this.length + n + POINTS) % POINTS);
      if (n) path.lineTo(this.trail[at], this.trail[at + 1]);
      else path.moveTo(this.trail[at], this.trail[at + 1]);
    }
  }
}

/**
 * Smaller turn from one heading to another [rad].
 * @param {number} from
 * @param {number} to
 */
function turn(from, to) {
  const way = (to - from) % (2 * Math.PI);
  if (way > Math.PI) return way - 2 * Math.PI;
  return way < -Math.PI ? way + 2 * Math.PI : way;
}
