/** Proposal panel: the policy's choice with its reason, beside all other candidates. */
import { computed, html, signal, useEffect } from '../../vendor/preact.js';
import { connection, mayDispatch } from '../store.js';
import { act, ask as askQuietly } from '../net/actions.js';
import { sinceSent, worldNow } from '../net/world_time.js';
import { isOpen } from '../map/shown.js';
import { secondsText } from '../ui/words.js';
import { reason } from './shared.js';

/** @typedef {import('../lines.js').SiteEvent} SiteEvent */
/** @typedef {import('../lines.js').Proposal} Proposal */

const AGAIN_MS = 4000;
const SOON_MS = 500; // where it could not be asked, as while the page connects

const known = signal(/** @type {Proposal & {t: number} | null} */ (null));
const refusal = signal('');
const wanted = signal('');

/** Responder that Assign sends: the one picked, else the one proposed, else the first free one. */
export const chosen = computed(() => {
  const proposal = known.value;
  if (!proposal) return '';
  const able = proposal.candidates.filter((who) => who.can);
  if (able.some((who) => who.label === wanted.value)) return wanted.value;
  return proposal.label || able.find((who) => who.free)?.label || '';
});

/** Free guard who would arrive first. */
export const nearestGuard = computed(() => first((who) => !who.robot));
/** Free robot that would arrive first. */
export const nearestRobot = computed(() => first((who) => who.robot));

/** @param {(who: import('../lines.js').Candidate) => boolean} fits */
const first = (fits) => known.value?.candidates.find((who) => who.free && fits(who))?.label ?? '';

/**
 * Assign a responder; an event decided on by somebody else in the meantime is left unchanged.
 * @param {SiteEvent} event
 * @param {string} whom
 * @param {string} [task]
 */
export async function assignTo(event, whom, task) {
  const done = await act('event_assign', {
    event: event.number,
    device: whom,
    reason: reason.peek(),
    decisions: event.decisions ?? null,
    ...(task ? { task } : {}),
  });
  if (done.ok) reason.value = '';
  return done;
}

/** @param {{event: SiteEvent}} props */
export function ProposalPanel({ event }) {
  useEffect(() => keepAsking(event), [event.number, event.decisions, event.state, connection.value]);
  if (!isOpen(event)) return null;
  const proposal = known.value?.event === event.number ? known.value : null;
  if (refusal.value) return html`<p class="warning" role="alert">No proposal: ${refusal.value}</p>`;
  if (!proposal) return html`<p class="none">Asking the policy …</p>`;
  const rival = proposal.candidates.find((who) => who.free && who.label !== proposal.label);
  return html`<section class="proposal reported" aria-label="Proposal">
    <p><b>${proposal.label ? `${proposal.label}, ${timeText(proposal.arrival_s)}` : 'nobody'}</b>
      ${rival ? ` (${rival.label}: ${timeText(rival.arrival_s)}, ${rival.reason})` : ''}
      <small>${proposal.policy}: ${proposal.reason}</small></p>
    ${proposal.decide_within_s !== null &&
    html`<p class="ask" role="status">The policy sends them by itself in ${secondsText(Math.max(0, proposal.decide_within_s - sinceSent(proposal)))} unless you decide.</p>`}
    <fieldset><legend>Whom to send</legend>
      ${proposal.candidates.map((who) => html`<${Candidate} key=${who.label} who=${who} />`)}
    </fieldset></section>`;
}

/** @param {{who: import('../lines.js').Candidate}} props */
function Candidate({ who }) {
  return html`<label class=${who.can ? 'candidate' : 'candidate cannot'}>
    <input type="radio" name="candidate" value=${who.label} checked=${chosen.value === who.label}
      disabled=${!who.can} onInput=${() => (wanted.value = who.label)} />
    <span>${who.label}</span><span class="figure">${timeText(who.arrival_s)}</span>
    <small>${who.reason}</small></label>`;
}

/** @param {number | null} seconds */
const timeText = (seconds) => (seconds === null ? '–' : secondsText(seconds));

/** Request a proposal now, and periodically while the event is shown. @param {SiteEvent} event */
function keepAsking(event) {
  if (known.peek()?.event !== event.number) {
    known.value = null;
    refusal.value = '';
    wanted.value = '';
  }
  if (!mayDispatch.peek() || connection.peek() !== 'open' || !isOpen(event)) return undefined;
  let over = false;
  const ask = async () => {
    const done = document.hidden ? null : await askQuietly('event_proposal', { event: event.number });
    if (over) return;
    if (done?.ok && done.proposal) known.value = { ...done.proposal, t: done.t ?? worldNow() };
    refusal.value = done?.outcome === 'refused' ? done.text : '';
    if (!refusal.value) window.setTimeout(ask, done?.ok ? AGAIN_MS : SOON_MS);
  };
  ask();
  return () => {
    over = true;
  };
}
