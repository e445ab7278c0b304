/** Proposal panel: the policy's choice with its reason, beside all other candidates. */
import { computed, html, signal, useEffect } from '../../vendor/preact.js';
import { connection, mayDispatch, modeOf, robots, rowOf } from '../store.js';
import { act, ask as askQuietly } from '../net/actions.js';
import { sinceSent, worldNow } from '../net/world_time.js';
import { isOpen } from '../map/shown.js';
import { secondsText } from '../ui/words.js';
import { reason } from './shared.js';

/** @typedef {import('../lines.js').SiteEvent} SiteEvent */
/** @typedef {import('../lines.js').Proposal} Proposal */
/** @typedef {import('../lines.js').Candidate} Candidate */

const REFRESH_MS = 4000;
const SOON_MS = 500; // where it could not be asked, as while the page connects

const known = signal(/** @type {Proposal & {t: number} | null} */ (null));
const refusal = signal('');
const wanted = signal('');

/** Candidates for the event in hand, the policy's proposal first. */
const candidates = computed(() => known.value?.candidates ?? []);

/** Responder whom the panel would send: the one picked, else the one proposed, else the first who can go. */
export const chosen = computed(() => {
  const able = candidates.value.filter((who) => waysOf(who).length);
  if (able.some((who) => who.label === wanted.value)) return wanted.value;
  return known.value?.label || (able.find((who) => who.free) ?? able[0])?.label || '';
});

/** Candidate of that name. @param {string} label */
export const candidateOf = (label) => candidates.value.find((who) => who.label === label);

/** Free robot that would arrive first. */
export const nearestRobot = computed(() => candidates.value.find((who) => who.free && who.robot)?.label ?? '');

/** True once the person has picked somebody: nobody else takes their place in the button. */
export const isPicked = computed(() => Boolean(wanted.value) && wanted.value === chosen.value);

/**
 * Name of a candidate, of whom they replace, and the time until their arrival.
 * @param {string} label
 * @param {string} [replaced]
 */
export const estimateOf = (label, replaced) => {
  const time = candidateOf(label)?.arrival_s ?? null;
  const whom = replaced ? `${label} instead of ${replaced}` : label;
  return time === null ? whom : `${whom}, ${secondsText(time)}`;
};

/**
 * Ways to send a candidate, the likeliest first: by the DVA's order, on a mission without a driver, or
 * driven from this page.
 * @param {Candidate | undefined} who
 * @returns {string[]}
 */
export function waysOf(who) {
  if (!who || (who.robot && known.value?.task === 'contain')) return []; // robots only look
  const robot = who.robot && robots.value.find((one) => one.label === who.label);
  const canGo = robot && (who.free || (modeOf(robot.i) === 'Idle' && !rowOf(robot.i)?.holder));
  const alone = canGo && 'mission';
  const ordered = who.can && 'order';
  const first = who.free ? [ordered, alone] : [alone, ordered]; // no operator may be there to drive it
  return [...first, robot && (who.can || canGo) && 'drive'].filter((way) => typeof way === 'string');
}

/** Choose a candidate by place in the list, from 0. @param {number} place */
export const chooseCandidate = (place) => (wanted.value = candidates.peek()[place]?.label ?? wanted.peek());

/**
 * Assign a responder, to a confirmed event to contain it; an event decided on by somebody else in
 * the meantime is left unchanged.
 * @param {SiteEvent} event
 * @param {string} whom
 */
export async function assignTo(event, whom) {
  const done = await act('event_assign', {
    event: event.number,
    device: whom,
    reason: reason.peek(),
    decisions: event.decisions ?? null,
    ...(event.state === 'confirmed' ? { task: 'contain' } : {}),
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
  return html`<section class="proposal reported" aria-label="Proposal">
    <p>The policy proposes <b>${proposal.label || 'nobody'}</b> <small>${proposal.policy}: ${proposal.reason}</small></p>
    ${proposal.decide_within_s !== null &&
    html`<p class="ask" role="status">The policy sends them by itself in ${secondsText(Math.max(0, proposal.decide_within_s - sinceSent(proposal)))} unless you decide.</p>`}
    <fieldset><legend>Whom to send</legend>
      ${proposal.candidates.map((who) => html`<${CandidateRow} key=${who.label} who=${who} />`)}
    </fieldset></section>`;
}

/** @param {{who: Candidate}} props */
function CandidateRow({ who }) {
  const able = waysOf(who).length > 0;
  return html`<label class=${able ? 'candidate' : 'candidate cannot'}>
    <input type="radio" name="candidate" value=${who.label} checked=${chosen.value === who.label}
      disabled=${!able} onInput=${() => (wanted.value = who.label)} />
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
    if (!refusal.value) window.setTimeout(ask, done?.ok ? REFRESH_MS : SOON_MS);
  };
  ask();
  return () => {
    over = true;
  };
}
