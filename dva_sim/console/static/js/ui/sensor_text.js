/** Values of sensors as text, with their units. */

const UNITS = /** @type {Record<string, string>} */ ({ degC: '°C', 1: '', 'kW/m2': 'kW/m²' });

/** @param {string} unit */
export const unitText = (unit) => UNITS[unit] ?? unit;

/** @param {{name: string, unit: string, values?: number[], least?: number}} sensor */
export function valueText({ name, unit, values, least }) {
  if (least !== undefined) return `nearest ${least.toFixed(2)} ${unitText(unit)}`;
  if (!values?.length) return 'no value: it is lost';
  if (name === 'battery') return `${(100 * values[0]).toFixed(0)} %`;
  return `${values.join(' ')} ${unitText(unit)}`;
}
