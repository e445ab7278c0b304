/** Instructions for the app: authentication, calibration, driving, in this order. */
import { html } from '../../vendor/preact.js';
import { scene } from '../store.js';

/** The screen. */
export function InstructionsScreen() {
  const watchdog = scene.value?.watchdog_s ?? 3;
  return html`<article class="words">
    <h2>1. Authenticate a device</h2>
    <ol>
      <li>Open <a href="#/authentication">Authentication</a>. Server IP and port are those of the DVA;
        they are filled in already. Give your phone a label so that others recognise it.</li>
      <li>Press <b>Register</b>. The DVA now knows your phone as a device.</li>
      <li>Press <b>Get device list</b> and choose the robot.</li>
      <li>Choose a permission level and press <b>Get Permission Level</b>. One robot has one driver: if somebody else is driving it, you see who.</li>
    </ol>
    <h2>2. Calibrate</h2>
    <ol>
      <li>Open <a href="#/calibration">Calibration</a> and hold the phone as you will while you drive. A phone calibrated while you stand reads differently when you lie down.</li>
      <li>Watch speed and turn as you tilt. <b>Force</b> is how far you tilt forwards for the next level
        of speed, <b>Radius step</b> how far to the side for the next degree per second.</li>
      <li><b>Maximum delay</b> is the longest time between two messages.</li>
      <li>Press <b>Calibrate</b>: the way you hold the phone now means standing still.</li>
    </ol>
    <h2>3. Drive</h2>
    <ol>
      <li>Open <a href="#/teleoperation">Teleoperation</a>. <b>Swipe up</b>, or press Start, to begin driving.</li>
      <li>Tilt forwards to drive, at most 0.5 m/s, and to the side to turn, at most 30 degrees per
        second. There is no reverse.</li>
      <li><b>Swipe down</b>, or press Stop, to stop. You can start again at any time.</li>
      <li><b>Emergency stop</b> works on every screen. The robot does not move until you start again.</li>
    </ol>
    <h2>When something goes wrong</h2>
    <p>The robot is stopped when the page is hidden, the phone is locked or rotated, the sensor stops, or the connection breaks. It never resumes
      by itself: start again.</p>
    <p>The alert <b>link lost</b> means that three messages in a row got no reply. The robot stops by itself when no command has
      arrived for ${watchdog} s.</p>
    <p>Without a motion sensor you steer by the stick on the screen, arrow keys, or a gamepad while you
      hold its shoulder button.</p>
  </article>`;
}
