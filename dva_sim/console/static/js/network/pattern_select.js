/** Selection of the messaging pattern that carries a robot's commands. */
import { html } from '../../vendor/preact.js';
import { maySteer, rowOf, rows, scene } from '../store.js';
import { act } from '../net/actions.js';

/** @param {{robot: import('../lines.js').Thing}} props */
export function PatternSelect({ robot }) {
  void rows.value;
  const now = rowOf(robot.i)?.pattern ?? '';
  const change = (/** @type {any} */ event) =>
    act('pattern', { robot: robot.i, name: event.currentTarget.value });
  return html`<label class=${`pattern-select pattern-${now}`}>
    <span class="hidden">Pattern of ${robot.label}</span>
    <select value=${now} disabled=${!maySteer.value} onChange=${change}>
      ${(scene.value?.patterns ?? []).map(
        (pattern) => html`<option value=${pattern.name} selected=${pattern.name === now}>${pattern.title}</option>`,
      )}
    </select></label>`;
}
