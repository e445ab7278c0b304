/** Icons of the sprite, and the marks of severities and states: always shown with a word beside them. */
import { html } from '../../vendor/preact.js';
import { SOURCE_SHAPES, STATES, stateColour } from '../map/marks.js';
import { HAZARDS } from '../palette.js';

/** @param {{name: string}} props */
export function Icon({ name }) {
  return html`<svg class="icon" aria-hidden="true" focusable="false">
    <use href=${`/static/vendor/icons.svg#${name}`}></use>
  </svg>`;
}

const SHAPES = /** @type {Record<string, string>} */ ({
  critical: 'M8 1h8l7 7v8l-7 7H8l-7-7V8z',
  high: 'M12 2L23 21H1z',
  medium: 'M3 3h18v18H3z',
  low: 'M12 3a9 9 0 1 0 .01 0z',
});

/** @param {{severity: string, quiet?: boolean}} props */
export function SeverityMark({ severity, quiet = false }) {
  const look = quiet ? 'mark quiet' : `mark ${severity}`;
  return html`<svg class=${look} viewBox="0 0 24 24" aria-hidden="true" focusable="false">
    <path d=${SHAPES[severity] ?? SHAPES.low} />
  </svg>`;
}

/** Mark of a hazard's source, as on the map. @param {{kind: string}} props */
export function SourceMark({ kind }) {
  const look = /** @type {Record<string, {mark: string, colour: string}>} */ (HAZARDS)[kind];
  return html`<svg class="icon source" viewBox="-.65 -.65 1.3 1.3" aria-hidden="true" focusable="false">
    <path d=${SOURCE_SHAPES[look.mark]} fill=${look.colour} stroke="currentColor" stroke-width=".08" />
  </svg>`;
}

/** @param {{state: string}} props */
export function StateMark({ state }) {
  return html`<svg class=${`icon ${stateColour(state)}`} viewBox="0 0 24 24" aria-hidden="true"
    focusable="false" fill="none" stroke="currentColor" stroke-width="2.2"
    stroke-linecap="round" stroke-linejoin="round"><path d=${STATES[state] ?? STATES.pending} />
  </svg>`;
}

const GLYPHS = /** @type {Record<string, string>} */ ({
  Mission: 'M5 8l4 4-4 4',
  Teleoperation: 'M9.6 12a2.4 2.4 0 1 1-4.8 0 2.4 2.4 0 0 1 4.8 0',
  Manual: 'M5 12h6',
  Emergency: 'M5 9l6 6M11 9l-6 6',
  Lost: 'M5.4 10a2.8 2.2 0 1 1 3 2.4V13M8.4 16v.2',
});

/** The box with a bow, as on the map. @param {{mode: string}} props */
export function ModeMark({ mode }) {
  return html`<svg class=${`mode-mark ${mode.toLowerCase()}`} viewBox="0 0 24 24"
    aria-hidden="true" focusable="false">
    <path class="body" d="M2 4H15L22 12L15 20H2Z" />
    ${GLYPHS[mode] && html`<path class="glyph" d=${GLYPHS[mode]} />`}
  </svg>`;
}
