/** Link status: the round trip of the newest drive, or the state of the connection. */
import { html } from '../../vendor/preact.js';
import { connection, link, seat } from '../store.js';
import { msText } from '../ui/words.js';
import { isLinkLost } from './drive.js';

const POOR_MS = 600;
const FAIR_MS = 250;

/** The status, with bars that match the text. */
export function LinkStatus() {
  const trip = seat.value?.drives[0]?.round_trip_ms ?? null;
  const modelled = link.value?.delay_s === undefined ? null : 2 * 1000 * link.value.delay_s;
  const known = trip ?? modelled;
  const [bars, text] = isLinkLost()
    ? [0, 'link lost']
    : connection.value !== 'open'
      ? [0, 'connecting']
      : [rank(known), msText(known)];
  return html`<span class=${`link-status reported bars-${bars}`} role="status" aria-label="Link" aria-live="off"
    title=${`There and back between this phone and the robot${trip === null ? ', as the link is modelled' : ''}`}>
    <span class="bars" aria-hidden="true"><i></i><i></i><i></i></span>${text}</span>`;
}

/** @param {number | null} ms */
function rank(ms) {
  if (ms === null) return 3;
  return ms > POOR_MS ? 1 : ms > FAIR_MS ? 2 : 3;
}
