/** Numbers formatted for reading: with units, and no more digits than are useful. */

/** @param {number} ms */
export function clockText(ms) {
  const seconds = Math.max(0, Math.floor(ms / 1000));
  const [h, m, s] = [Math.floor(seconds / 3600), Math.floor(seconds / 60) % 60, seconds % 60];
  return `${h}:${String(m).padStart(2, '0')}:${String(s).padStart(2, '0')}`;
}

/** @param {number} ms */
export function ageText(ms) {
  const seconds = Math.max(0, Math.floor(ms / 1000));
  const minutes = Math.floor(seconds / 60);
  if (minutes >= 60) return `${Math.floor(minutes / 60)} h ${minutes % 60} min`;
  return `${minutes}:${String(seconds % 60).padStart(2, '0')}`;
}

/** @param {number | null | undefined} value */
export const isNumber = (value) => typeof value === 'number' && Number.isFinite(value);

/** @param {number | null | undefined} ms */
export function msText(ms) {
  if (!isNumber(ms)) return '–';
  const value = /** @type {number} */ (ms);
  return value >= 10000 ? `${(value / 1000).toFixed(1)} s` : `${Math.round(value)} ms`;
}

/** @param {number} seconds */
export function secondsText(seconds) {
  if (seconds < 10) return `${seconds.toFixed(1)} s`;
  return seconds < 120 ? `${Math.round(seconds)} s` : `${Math.floor(seconds / 60)} min`;
}

/** @param {number | null | undefined} share */
export const percentText = (share) =>
  isNumber(share) ? `${Math.round(100 * /** @type {number} */ (share))} %` : '–';

/** @param {number | null} bps */
export function rateText(bps) {
  if (!bps) return 'no limit';
  const steps = /** @type {[number, string][]} */ ([[1e9, 'Gbit/s'], [1e6, 'Mbit/s'], [1e3, 'kbit/s']]);
  const [size, unit] = steps.find(([least]) => bps >= least) ?? [1, 'bit/s'];
  const value = bps / size;
  return `${value < 10 ? Number(value.toFixed(1)) : Math.round(value)} ${unit}`;
}

/** A kind of hazard or mode as words. @param {string} name */
export const plain = (name) => name.replace(/_/g, ' ');

/** @param {string} text */
export const capital = (text) => text.charAt(0).toUpperCase() + text.slice(1);
