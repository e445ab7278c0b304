/** A person's choices, saved on the phone and restored on loading. */
import { signal } from '../../vendor/preact.js';

const KEY = 'dva-sim-phone';

/**
 * @typedef {{server: string, port: string, label: string, type: string, device: string,
 *   level: string, force: string, radius: string, delay: string, pipeline: string,
 *   filter: string, mapping: string, reference: number[] | null, calibrated: boolean,
 *   hand: string, hold: boolean, keep: boolean, by: string}} Choices
 */

/** @type {Choices} */
const FIRST = {
  server: '',
  port: '',
  label: '',
  type: 'Teleoperation',
  device: '',
  level: 'teleoperation',
  force: '',
  radius: '',
  delay: '',
  pipeline: '',
  filter: '',
  mapping: 'absolute',
  reference: null,
  calibrated: false,
  hand: 'right',
  hold: false,
  keep: false,
  by: 'tilt',
};

/** The newest choices. */
export const choices = signal(remembered());

/** @param {Partial<Choices>} changed */
export function choose(changed) {
  choices.value = { ...choices.peek(), ...changed };
  try {
    localStorage.setItem(KEY, JSON.stringify(choices.peek()));
  } catch {
    // A browser that keeps nothing asks again next time.
  }
}

/** Saved choices; values of the wrong type are ignored. */
function remembered() {
  const found = { ...FIRST };
  try {
    const kept = JSON.parse(localStorage.getItem(KEY) ?? '{}');
    for (const [name, value] of Object.entries(FIRST)) {
      if (typeof kept[name] === typeof value && value !== null) Object.assign(found, { [name]: kept[name] });
    }
    if (isPlace(kept.reference)) found.reference = kept.reference;
  } catch {
    return found;
  }
  return found;
}

/** @param {any} value true for an array of three numbers */
const isPlace = (value) =>
  Array.isArray(value) && value.length === 3 && value.every((one) => Number.isFinite(one));
