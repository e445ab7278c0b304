/** Report of an event that the guard has seen: kind, severity, and the guard's position. */
import { html, useState } from '../../vendor/preact.js';
import { maySteer, tracks } from '../store.js';
import { act } from '../net/actions.js';
import { Choice } from '../ui/fields.js';
import { KINDS, SEVERITIES } from '../ui/report_choices.js';

/** @param {{me: import('../lines.js').Guard}} props */
export function Report({ me }) {
  const [kind, setKind] = useState('fire');
  const [severity, setSeverity] = useState('medium');
  const [result, setResult] = useState('');
  const report = async () => {
    setResult('');
    const at = tracks.last(me.guard);
    if (!at) return;
    const done = await act('guard_report', { kind, severity, x_m: at.x, y_m: at.y });
    setResult(done.ok ? `Sent: ${done.text}` : '');
  };
  return html`<section class="panel" aria-label="Report"><details><summary>Report an event</summary>
    <div class="report"><${Choice} name="Kind" value=${kind} options=${KINDS} onInput=${setKind} />
      <${Choice} name="Severity" value=${severity} options=${SEVERITIES} onInput=${setSeverity} />
      <button type="button" class="big" disabled=${!maySteer.value || !tracks.last(me.guard)}
        onClick=${report}>Report at my position</button>
      <p role="status" aria-label="Report">${result}</p></div></details></section>`;
}
