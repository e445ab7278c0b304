/**
 * What pages have beside lines, by name; the types of lines are in `lines.js`.
 *
 * @typedef {{number: number, time_s: number, at_utc: string, author: string, device: string,
 *   role: string, action: string, event: number | null, subject: string, cause: string,
 *   outcome: string, text: string, details: Record<string, any>, hash: string}} AuditRow
 * @typedef {{rows: number, hash: string, problem: {row: number, text: string} | null,
 *   doubts: string[]}} AuditCheck
 * @typedef {{events: number, median_s: number | null, largest_s: number | null}} Times
 * @typedef {{acknowledge: Times, assign: Times, assigned_by_people: number,
 *   assigned_by_policy: number, overrides: number, lost_s: number | null,
 *   newest_overrides: {number: number, event: number, author: string, did: string,
 *   did_s: number | null, advised: string | null, advised_s: number | null,
 *   cause: string}[]}} AuditMeasures
 * @typedef {Omit<import('./lines.js').Done, 'k' | 'id'> & {id?: string | null}} Answer
 * @typedef {{x: number, y: number, radius: number, name: string}} Goal
 * @typedef {{kind: 'thing' | 'event', key: number} | null} Selection
 */
export {};
