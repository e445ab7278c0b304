/** Kinds and severities that a person can report, with their names. */
import { plain } from './words.js';

const pairs = (/** @type {string[]} */ names) =>
  /** @type {[string, string][]} */ (names.map((name) => [name, plain(name)]));
export const KINDS = pairs(['fire', 'gas_leak', 'flood']);
export const SEVERITIES = pairs(['low', 'medium', 'high', 'critical']);
