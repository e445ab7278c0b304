/** Recent values of some numbers, for charts and the figures beside them. */

/** Times [s] with their values; those older than the span are discarded. */
export class History {
  /**
   * @param {number} width number of values per time
   * @param {number} [span] [s]
   */
  constructor(width, span = 40) {
    this.span = span;
    /** @type {number[][]} */
    this.columns = Array.from({ length: width + 1 }, () => []);
  }

  /**
   * @param {number} time
   * @param {(number | null)[]} values
   */
  add(time, values) {
    const [times] = this.columns;
    if (times.length && time < (times.at(-1) ?? 0)) this.clear();
    [time, ...values].forEach((value, n) => this.columns[n].push(/** @type {number} */ (value)));
    while (times.length && times[0] < time - this.span) this.columns.forEach((one) => one.shift());
  }

  clear() {
    this.columns.forEach((column) => (column.length = 0));
  }

  /** Return the columns in the format of the charts. */
  read() {
    return this.columns.map((column) => column.slice());
  }

  /** @param {number} n */
  last(n) {
    return this.columns[n + 1].at(-1) ?? null;
  }

  /**
   * 95th percentile of a column; null without values.
   * @param {number} n
   */
  p95(n) {
    const known = this.columns[n + 1].filter((value) => Number.isFinite(value) && value !== null);
    if (!known.length) return null;
    return known.sort((a, b) => a - b)[Math.ceil(0.95 * known.length) - 1];
  }
}
