/** Legend of the map's marks and colours. */
import { html } from '../../vendor/preact.js';
import { hazards } from '../store.js';
import { HAZARDS } from '../palette.js';
import { ModeMark, SeverityMark, SourceMark, StateMark } from '../ui/icon.js';
import { plain } from '../ui/words.js';

const MODES = ['Idle', 'Mission', 'Teleoperation', 'Manual', 'Emergency', 'Lost'];
const STATES = ['pending', 'assigned', 'on scene', 'confirmed', 'contained', 'refuted',
  'escalated', 'expired']; // prettier-ignore

/** The legend, folded until somebody opens it. */
export function Legend() {
  return html`<details class="legend">
    <summary>Legend</summary>
    <div class="legend-body" tabindex="0" role="group" aria-label="Marks and colours">
      <ul>
        ${MODES.map((mode) => html`<li><${ModeMark} mode=${mode} />robot: ${mode.toLowerCase()}</li>`)}
        <li><span class="dot guard"></span>guard</li>
        <li><span class="dot bystander"></span>bystander</li>
        <li><span class="cone"></span>what the camera sees</li>
        <li><span class="dashes"></span>is sent there</li>
        <li><span class="trail"></span>where it came along</li>
        <li><span class="battery"></span>battery</li>
        <li><span class="door"></span>door</li>
        <li><span class="exit"></span>exit</li>
      </ul>
      <ul>
        ${['critical', 'high', 'medium', 'low'].map(
          (rank) => html`<li><${SeverityMark} severity=${rank} />event: ${rank}</li>`,
        )}
        ${Object.keys(HAZARDS).map((kind) => html`<li><${SourceMark} kind=${kind} />source: ${plain(kind)}</li>`)}
        <li><span class="field smoke"></span>smoke</li>
        <li><span class="field gas"></span>gas</li>
        <li><span class="field water"></span>water</li>
        <li><span class="field fire"></span>heat</li>
      </ul>
      <ul>
        ${STATES.map((state) => html`<li><${StateMark} state=${state} />${state}</li>`)}
      </ul>
      <${Fullest} />
    </div>
  </details>`;
}

/** Values that the strongest tint stands for. */
function Fullest() {
  const fields = hazards.value.fields.filter((field) => field.full);
  if (!fields.length) return null;
  return html`<p>Fullest tint: ${fields.map(fullest).join('; ')}</p>`;
}

/** @param {import('../lines.js').Field} field */
const fullest = ({ kind, full }) =>
  `${plain(kind)} ${typeof full === 'object' ? `${full.value} ${full.unit}` : full}`;
