/** Top bar: time, link, age of the data, alarms, the person's role, emergency stop. */
import { html } from '../../vendor/preact.js';
import {
  clock, isAttached, isBeside, isModelled, isPast, link, maySteer, replay, scene, you,
} from '../store.js';
import { act } from '../net/actions.js';
import { emergencyStop } from '../net/emergency.js';
import { roundTrip } from '../net/round_trip.js';
import { isStale, pageAge, shownTime } from '../net/world_time.js';
import { alarms } from '../map/shown.js';
import { Icon, SeverityMark } from '../ui/icon.js';
import { clockText, secondsText } from '../ui/words.js';
import { SoundButton } from './calling.js';
import { dark, switchTheme } from './theme.js';
import { openHelp } from '../help/help.js';

/** The bar. */
export function Bar() {
  return html`<header class="bar">
    <${Time} /><${Link} /><${Age} /><${Alarms} /><span class="gap"></span><${Who} />
    ${you.value?.user && html`<button type="button" key="log-out" class="plain" title=${you.value.user} onClick=${logOut}>Log out</button>`}
    ${!isPast.value && html`<${SoundButton} />`}
    <button type="button" class="plain" onClick=${openHelp} aria-label="Help" title="Help (?)">
      <${Icon} name="circle-question-mark" /></button>
    <button type="button" class="plain" onClick=${switchTheme}
      aria-label=${dark.value ? 'Light colours' : 'Dark colours'}
      title=${dark.value ? 'Light colours' : 'Dark colours'}>
      <${Icon} name=${dark.value ? 'sun' : 'moon'} /></button>
    ${!isPast.value && html`<button type="button" key="stop-all" class="emergency" onClick=${emergencyStop}
      title="Stops all robots at once (Shift+Esc)"><${Icon} name="octagon-x" />Emergency stop</button>`}
  </header>`;
}

function Time() {
  const { factor, paused } = clock.value;
  const name = paused ? 'Resume' : 'Pause';
  return html`<span class="item time" title="Simulation time and speed">
    <span class="figure reported">${clockText(shownTime())}</span>
    <span class="soft">${paused ? 'paused' : `×${Number(factor.toFixed(1))}`}</span>
    ${!isPast.value && !isAttached.value && html`<button type="button" key="pace" class="plain" disabled=${!maySteer.value || !isModelled.value}
      aria-label=${name} title=${isModelled.value ? name : 'With real sockets the simulation runs in real time'}
      onClick=${() => act('pace', { paused: !paused })}>
      <${Icon} name=${paused ? 'play' : 'pause'} /></button>`}
  </span>`;
}

function Link() {
  const setting = link.value;
  if (isPast.value) {
    const text = replay.value ? `recording ${replay.value.name}` : 'no recording yet';
    return html`<span class="item link" role="status" aria-label="Link"
      title="You are watching a recording">${text}</span>`;
  }
  const delay = setting?.delay_s === undefined ? '–' : `${Math.round(1000 * setting.delay_s)} ms`;
  const loss = setting?.loss ? `, ${Number((100 * setting.loss).toFixed(1))} % lost` : '';
  if (!isModelled.value && setting?.delay_s !== undefined) {
    return html`<span class="item link" role="status" aria-label="Link"
      title="The console reaches the robots through real sockets over an emulated link. The delay is one-way.">
      emulated ${delay}${loss}</span>`;
  }
  if (!isModelled.value) {
    return html`<span class="item link" role="status" aria-label="Link"
      title=${isBeside.value ? 'This page runs beside its DVA and only knows what messages say.' : isAttached.value ? 'This console shows a remote system and only knows what its messages say.' : 'The console reaches the robots through real sockets, not through a simulated link.'}>
      ${isBeside.value ? `DVA ${scene.value?.dva_address}` : isAttached.value ? `attached to ${scene.value?.dva_address}` : 'real'}</span>`;
  }
  const trace = setting?.trace ? `, ${setting.trace}` : '';
  return html`<span class="item link modelled" role="status"
    aria-label="Link" title="The simulated link between the console and the robots. The delay is one-way.">
    modelled ${delay}${loss}${trace}</span>`;
}

function Age() {
  const age = pageAge();
  const known = Number.isFinite(age);
  const error = roundTrip.value.error;
  const more = Number.isNaN(error) ? '' : `; to the server and back ${roundTrip.value.ms.toFixed(1)} ms, clocks ±${error.toFixed(1)} ms`;
  return html`<span class=${isStale.value ? 'item age old' : 'item age'} title=${`Age of the latest update from the simulation${more}`}>
    <span class="word">data </span>${known ? secondsText(age) : '–'}<span class="word">${known ? ' old' : ''}</span></span>`;
}

function Alarms() {
  const counts = alarms();
  return html`<a class="item alarms reported" href="#/events" title="Open events, by severity"><span class="word soft">alarms</span>
    ${Object.entries(counts).map(
      ([rank, count]) => html`<span class=${count ? 'some' : 'nothing'} title=${`${count} open events of severity ${rank}`}>
        <${SeverityMark} severity=${rank} quiet=${!count} />${count}<span class="hidden">${rank}</span></span>`,
    )}</a>`;
}

function Who() {
  const me = you.value;
  if (!me) return null;
  return html`<span class="item who" title=${`What your address allows. The simulation calls this page ${me.client}.`}>
    ${me.user || 'you'} may ${me.role === 'phone' ? 'drive' : me.role}</span>`;
}

async function logOut() {
  await fetch('/logout', { method: 'POST' });
  location.assign('/login');
}
