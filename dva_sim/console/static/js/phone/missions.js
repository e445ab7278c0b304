/** Missions on the phone: the robot in hand goes by itself, over places tapped on the map. */
import { html } from '../../vendor/preact.js';
import { seat } from '../store.js';
import { MapBox } from '../map/map_box.js';
import { Missions, hasMissions, missionGoals, place } from '../missions/missions.js';
import { holds, robot } from './drive.js';

/** The screen. */
export function MissionsScreen() {
  const one = robot.value;
  void seat.value;
  if (!one || !holds.value || !hasMissions(one.i)) {
    return html`<p>You hold no robot for missions. Choose the permission level missions, or both:
      ${' '}<a href="#/authentication">Authentication</a> comes first.</p>`;
  }
  return html`<div class="map-region small" role="group" aria-label="Map">
      <${MapBox} cones=${() => [one.i]} legend=${false} keyboard=${false} goals=${missionGoals} onPlace=${place} /></div>
    <${Missions} robot=${one} />`;
}
