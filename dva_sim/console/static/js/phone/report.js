/** Report of an event that the person with the phone sees: kind, severity, and a place on the map. */
import { html, useState } from '../../vendor/preact.js';
import { maySteer } from '../store.js';
import { act } from '../net/actions.js';
import { MapBox } from '../map/map_box.js';
import { placeOf } from '../map/shown.js';
import { Choice } from '../ui/fields.js';
import { KINDS, SEVERITIES } from '../ui/report_choices.js';
import { phone } from './drive.js';

/** The screen. */
export function ReportScreen() {
  const [kind, setKind] = useState('fire');
  const [severity, setSeverity] = useState('medium');
  const [at, place] = useState(/** @type {[number, number] | null} */ (null));
  const [sent, tell] = useState(/** @type {{text: string, event?: number} | null} */ (null));
  if (!phone.value?.registered) {
    return html`<p>The DVA takes reports of registered phones: <a href="#/authentication">Authentication</a> comes first.</p>`;
  }
  const report = async () => {
    if (!at) return;
    tell(null);
    const done = await act('phone_report', { kind, severity, x_m: at[0], y_m: at[1] });
    if (done.ok) tell({ text: done.text, event: done.event });
  };
  return html`<section class="panel report" aria-label="Report an event">
    <div class="pair"><${Choice} name="Kind" value=${kind} options=${KINDS} onInput=${setKind} />
      <${Choice} name="Severity" value=${severity} options=${SEVERITIES} onInput=${setSeverity} /></div>
    <p role="status" aria-label="Place">${at ? placeOf({ x_m: at[0], y_m: at[1] }) : 'Tap the map where it is.'}</p>
    <div class="map-region small" role="group" aria-label="Map">
      <${MapBox} cones=${() => []} legend=${false} keyboard=${false} onPlace=${(/** @type {number} */ x, /** @type {number} */ y) => place([x, y])}
        goals=${() => (at ? [{ x: at[0], y: at[1], radius: 0.8, name: '' }] : [])} /></div>
    <button type="button" class="big go" disabled=${!at || !maySteer.value} onClick=${report}>Report</button>
    <p role="status" aria-label="Report">${sent && html`${sent.text}. ${sent.event && html`<a href=${`#/event?${sent.event}`}>Event ${sent.event}</a>`}`}</p>
  </section>`;
}
