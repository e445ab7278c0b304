/** View of the event in hand: its place on the map, and the picture of a robot. */
import { html } from '../../vendor/preact.js';
import { isPast, modeOf, robots, rowOf, rows, tracks } from '../store.js';
import { CameraPicture } from '../drive/camera.js';
import { MapBox } from '../map/map_box.js';
import { ModeMark } from '../ui/icon.js';
import { chosen, nearestRobot } from './proposal.js';
import { inHand, place, raising } from './shared.js';

/** Map above, picture below. */
export function Sight() {
  const robot = shownRobot();
  const choose = (/** @type {number} */ x, /** @type {number} */ y) => (place.value = [x, y]);
  return html`<div class=${isPast.value || !robot ? 'sight alone' : 'sight'}>
    <section class="map-region" aria-label="Map">
      <${MapBox} cones=${cones} legend=${false} goals=${goals} ways=${ways} onPlace=${raising.value ? choose : undefined} />
    </section>
    ${!isPast.value && robot && html`<section class="cockpit" aria-label=${`Picture of ${robot.label}`}>
      <${Head} robot=${robot} />
      <${CameraPicture} key=${robot.i} robot=${robot} /></section>`}
  </div>`;
}

/** @param {{robot: import('../lines.js').Thing}} props */
function Head({ robot }) {
  void rows.value;
  const row = rowOf(robot.i);
  const holder = row?.holder_label || row?.holder;
  const event = inHand.value;
  const goes = event?.assigned.includes(robot.label) ? 'is sent there' : 'could go there';
  const about = [event && !event.over && goes, holder && `held by ${holder}`].filter(Boolean).join(', ');
  return html`<p class="robot-head reported"><${ModeMark} mode=${modeOf(robot.i)} /><b>${robot.label}</b>
    <span class="soft">${about}</span></p>`;
}

/** Robot whose picture is shown: the assigned one, else the chosen one, else the nearest one. */
function shownRobot() {
  const sent = robots.value.find((robot) => inHand.value?.assigned.includes(robot.label));
  const named = [chosen.value, nearestRobot.value];
  return sent ?? robots.value.find((robot) => named.includes(robot.label)) ?? robots.value[0] ?? null;
}

const cones = () => {
  const robot = shownRobot();
  return robot ? [robot.i] : [];
};

/** Place of a new event while it is chosen. */
function goals() {
  const at = place.peek();
  return raising.peek() && at ? [{ x: at[0], y: at[1], radius: 0.6, name: 'here' }] : [];
}

/** Straight line from the robot that would be sent to the event. */
function ways() {
  const event = inHand.peek();
  const thing = robots.peek().find((robot) => robot.label === chosen.peek());
  const from = thing && tracks.last(thing.i);
  if (raising.peek() || !event || event.over || !from) return [];
  return [[[from.x, from.y], [event.x_m, event.y_m]]];
}
