/**
 * Named types that pages use besides those of the messages, which are in `lines.js`.
 *
 * @typedef {Omit<import('./lines.js').Done, 'k' | 'id'> & {id?: string | null}} Answer
 * @typedef {{x: number, y: number, radius: number, name: string}} Goal
 * @typedef {{kind: 'thing' | 'event', key: number} | null} Selection
 */
export {};
