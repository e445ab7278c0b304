/** Choice of a person, shown until the simulation reports it or refuses it. */
import { useEffect, useState } from '../../vendor/preact.js';

/**
 * The requested value until it is reported or refused, else the reported one.
 * @template Value
 * @param {Value} reported
 * @param {(wanted: Value) => Promise<import('../types.js').Answer>} ask
 * @param {(value: Value) => unknown} [key]
 * @returns {[Value, (wanted: Value) => void]}
 */
export function useRequested(reported, ask, key = (value) => value) {
  const [requested, set] = useState(/** @type {{value: Value} | null} */ (null));
  const isSo = requested !== null && key(requested.value) === key(reported);
  useEffect(() => {
    if (isSo) set(null);
  }, [isSo]);
  const change = (/** @type {Value} */ value) => {
    const wanted = { value };
    set(wanted);
    ask(value).then((done) => !done.ok && set((now) => (now === wanted ? null : now)));
  };
  return [requested ? requested.value : reported, change];
}
