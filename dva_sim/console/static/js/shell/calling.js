/** Calls for the person: the page's title, a strip on each page, a sound and a notification. */
import { effect, html, signal } from '../../vendor/preact.js';
import { ageOf } from '../net/world_time.js';
import { select } from '../events/shared.js';
import { SeverityMark } from '../ui/icon.js';
import { ageText } from '../ui/words.js';
import { page } from './route.js';
import { callByAlarms, RANKS, unseen } from './unseen.js';

const BEEP_S = 0.18;

/** True while alarms sound; a browser lets a page sound only after a click. */
const sounds = signal(false);
let speaker = /** @type {AudioContext | null} */ (null);

/** Call for each alarm that is new or has become worse, in the title as well. */
export function callThePerson() {
  const name = document.title;
  callByAlarms(call);
  effect(() => {
    const [worst] = unseen.value;
    const title = `${page.value.charAt(0).toUpperCase()}${page.value.slice(1)} · ${name}`;
    document.title = worst ? `(${unseen.value.length}) ${worst.text}` : title;
  });
}

/** @param {import('../lines.js').AlarmRow} alarm */
function call(alarm) {
  if (!sounds.peek()) return;
  beep(1 + RANKS.indexOf(alarm.priority));
  if (document.hidden && window.Notification?.permission === 'granted') {
    new Notification(alarm.text, { body: `${alarm.priority}, not acknowledged`, tag: alarm.key });
  }
}

/** @param {number} times */
function beep(times) {
  if (!speaker) return;
  for (let n = 0; n < times; n += 1) {
    const tone = speaker.createOscillator();
    tone.frequency.value = 880;
    tone.connect(speaker.destination);
    tone.start(speaker.currentTime + 2 * n * BEEP_S);
    tone.stop(speaker.currentTime + (2 * n + 1) * BEEP_S);
  }
}

/** Button that switches the sound of alarms on and off, and shows which it is. */
export function SoundButton() {
  const on = sounds.value;
  const change = () => {
    sounds.value = !on;
    if (on) return;
    speaker ??= new AudioContext();
    speaker.resume();
    if (window.Notification?.permission === 'default') Notification.requestPermission();
  };
  return html`<button type="button" class="plain" aria-pressed=${on} aria-label="Sound of alarms"
    title=${on ? 'Alarms sound; click to mute them' : 'Alarms are mute; click to hear them'} onClick=${change}>
    <svg class="icon" viewBox="0 0 24 24" aria-hidden="true" fill="none" stroke="currentColor" stroke-width="2"
      stroke-linecap="round" stroke-linejoin="round"><path d="M4 9v6h4l5 4V5L8 9z" />
      <path d=${on ? 'M17 9a4 4 0 0 1 0 6' : 'M17 9l5 6M22 9l-5 6'} /></svg></button>`;
}

/** Open the worst alarm that nobody has acknowledged, on the page Events. */
export function openWorst() {
  const [worst] = unseen.peek();
  if (worst && worst.event !== null) select(worst.event);
  if (worst) location.hash = '#/events';
}

/** Worst alarm that nobody has acknowledged, with one button to it; the page Events lists it itself. */
export function Strip() {
  const [worst] = unseen.value;
  if (!worst || page.value === 'events') return null;
  const more = unseen.value.length - 1;
  return html`<section class="strip reported" aria-label="Worst alarm"><${SeverityMark} severity=${worst.priority} />
    <b>${worst.text}</b><span class="soft">${worst.priority}, not acknowledged for ${ageText(ageOf(worst.since_ms))}${more ? `; ${more} more` : ''}</span>
    <button type="button" onClick=${openWorst}>Open</button></section>`;
}
