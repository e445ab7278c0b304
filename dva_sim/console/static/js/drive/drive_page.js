/** Driving page: one or two robots with their pictures, the map and latencies. */
import { html, useEffect } from '../../vendor/preact.js';
import { connection, driveOf, seat, scene } from '../store.js';
import { ask, driveLost } from '../net/actions.js';
import { watch } from '../net/sockets.js';
import { LinkPanel } from '../network/link_panel.js';
import { MapBox } from '../map/map_box.js';
import { Missions, hasMissions, missionGoals, place } from '../missions/missions.js';
import { driven } from '../shell/route.js';
import { tourGoals } from '../tour/progress.js';
import { CameraPicture } from './camera.js';
import { Controls } from './controls.js';
import { driveByGamepad } from './gamepad.js';
import { interrupt, watchInterruptions } from './hold.js';
import { driveByKeys } from './keys.js';
import { Latency } from './latency.js';
import { OrderInHand } from './order.js';
import { RobotHead } from './robot_head.js';
import { Sensing } from './sensing.js';

/** The page. */
export function DrivePage() {
  const robots = driven.value;
  const key = robots.map((robot) => robot.i).join();
  useEffect(() => {
    watch(robots.map((robot) => robot.i));
    return () => watch([]);
  }, [key]);
  useEffect(steering, []);
  useEffect(() => {
    if (connection.value !== 'open' || driveLost.value) interrupt('The connection was lost.');
  }, [connection.value, driveLost.value]);
  const read = robots.filter((robot) => seat.value && driveOf(robot.i)?.sensors.length);
  const goers = robots.filter((robot) => seat.value && hasMissions(robot.i));
  const two = robots.length > 1;
  return html`<main class=${two ? 'page drive-page two' : 'page drive-page'} id="main" tabindex="-1">
    <h1 class="hidden">Drive</h1>
    <section class="camera-region" aria-label="Camera">
      ${robots.map(
        (robot, n) => html`<div class="cockpit" key=${robot.i}>
          <${RobotHead} robot=${robot} place=${n} />
          <${CameraPicture} robot=${robot} /></div>`,
      )}
    </section>
    <section class="map-region" aria-label="Map">
      <${MapBox} cones=${() => driven.peek().map((robot) => robot.i)} keyboard=${false}
        follows=${() => driven.peek()[0]?.i ?? null} goals=${goals}
        onPlace=${goers.length ? place : undefined} />
    </section>
    <div class="side"><${Alert} /><${OrderInHand} /><${Controls} robots=${robots} />
      ${read.map((robot) => html`<div class="panel" key=${robot.i}><h2>Sensors of ${robot.label}</h2><${Sensing} robot=${robot} /></div>`)}
      ${goers.map((robot) => html`<${Missions} key=${robot.i} robot=${robot} />`)}<${LinkPanel} /></div>
    <${Latency} robots=${robots} />
  </main>`;
}

/** Places to go to: of the tour, or of a mission. */
const goals = () => [...tourGoals(), ...missionGoals()];

/** Start steering by keys and gamepad; return a function that stops it. */
function steering() {
  const ends = [driveByKeys(), driveByGamepad(), watchInterruptions()];
  return () => {
    interrupt('The page was left.');
    if (seat.peek()?.phase === 'driving') ask('stop'); // else its watchdog stops it, and it counts as lost
    ends.forEach((end) => end());
  };
}

/** Alert shown to the driver at once: a lost link, a refusal. */
function Alert() {
  const text = scene.value && seat.value?.alert;
  return html`<div role="alert" class="seat-alert">${text && html`<p class="warning">${text}</p>`}</div>`;
}
