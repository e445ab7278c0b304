/** Robots page: a card for each robot, or the windows of the robot that the address names. */
import { html, useEffect } from '../../vendor/preact.js';
import { isPast, modeOf, robots, rowOf, rows, scene, tracks } from '../store.js';
import { CameraPicture } from '../drive/camera.js';
import { select } from '../events/shared.js';
import { eventsInOrder, isOpen, placeOf, roomAt } from '../map/shown.js';
import { watch } from '../net/sockets.js';
import { detail } from '../shell/route.js';
import { ModeMark } from '../ui/icon.js';
import { percentText, plain } from '../ui/words.js';
import { RobotPage } from './robot_page.js';

const MAX_PICTURES = 6; // of more, a page and its renderer have too much to draw

/** The page. */
export function RobotsPage() {
  const name = detail.value;
  const only = scene.value?.pages && robots.value.length === 1;
  if (!name && !only) return html`<${List} />`;
  const robot = robots.value.find((one) => !name || one.label === name || one.id === name);
  return robot ? html`<${RobotPage} key=${robot.i} robot=${robot} />` : html`<${Nobody} name=${name} />`;
}

/** @param {string} label */
export const robotAddress = (label) => `#/robots/${encodeURIComponent(label)}`;

/** @param {{name: string}} props */
function Nobody({ name }) {
  return html`<main class="page robots-page" id="main" tabindex="-1"><h1>Robots</h1>
    <p>There is no robot ${name} in this run. <a href="#/robots">All robots</a></p></main>`;
}

function List() {
  const key = robots.value.map((robot) => robot.i).join();
  const areSeen = !isPast.value && robots.value.length <= MAX_PICTURES;
  useEffect(() => {
    if (areSeen) watch(robots.peek().map((robot) => robot.i));
    return () => watch([]);
  }, [key, areSeen]);
  return html`<main class="page robots-page" id="main" tabindex="-1"><h1>Robots</h1>
    <ul class="robot-cards" aria-label="Robots">${robots.value.map(
      (robot) => html`<${Card} key=${robot.i} robot=${robot} isSeen=${areSeen} />`,
    )}</ul></main>`;
}

/**
 * Robot with what an operator looks for: its picture, place, task and holder.
 * @param {{robot: import('../lines.js').Thing, isSeen: boolean}} props
 */
function Card({ robot, isSeen }) {
  void rows.value;
  const row = rowOf(robot.i);
  const mode = modeOf(robot.i);
  const at = tracks.last(robot.i);
  const lines = /** @type {[string, unknown][]} */ ([
    ['Place', at ? roomAt(at.x, at.y) : 'unknown'],
    ['Task', taskOf(robot.label) ?? (mode === 'Mission' ? 'a mission, not to an event' : 'none')],
    ['Held by', row?.holder_label || row?.holder || 'nobody'],
    ['Speed', at ? `${at.speed.toFixed(2)} m/s` : 'unknown'],
    ['Battery', row?.battery === null ? 'unknown' : percentText(row?.battery)],
    ['Stopped', row?.stop_reason],
  ]);
  return html`<li class="cockpit" aria-label=${robot.label}>
    <h2 class="reported"><${ModeMark} mode=${mode} /> <a href=${robotAddress(robot.label)}>${robot.label}</a> <span class="soft">${mode}</span></h2>
    ${isSeen && html`<${CameraPicture} robot=${robot} />`}
    <dl class="reported">${lines.filter(([, text]) => text).map(
      ([name, text]) => html`<dt>${name}</dt><dd>${text}</dd>`,
    )}</dl></li>`;
}

/** @param {string} label */
function taskOf(label) {
  const event = eventsInOrder().find((one) => isOpen(one) && one.assigned.includes(label));
  return event ? html`<a href="#/events" onClick=${() => select(event.number)}>${plain(event.kind)}, ${placeOf(event)}</a>` : null;
}
