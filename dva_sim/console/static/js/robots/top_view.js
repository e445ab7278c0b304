/** Top view of the robot, facing right: its wheels are turned by the commanded turn rate. */
import { html } from '../../vendor/preact.js';
import { isModelCar } from './side_view.js';
import { degrees, fixed, side, windowOf } from './window.js';

const MAX_DEG = 30;
const CAR_DEG = 25; // how far a model car's wheels go, whatever is asked for

/** @typedef {import('../lines.js').Thing} Thing */

/** @param {{robot: Thing}} props */
export function TopView({ robot }) {
  const rate = windowOf(robot.i)?.turn_rate_radps ?? 0;
  const way = side(rate);
  const car = isModelCar(robot);
  const asked = Math.max(-MAX_DEG, Math.min(MAX_DEG, degrees(rate)));
  const angle = car ? CAR_DEG * Math.sign(Number(rate.toFixed(3))) : asked;
  const text = car ? `steering ${way}` : `turn rate ${fixed(degrees(rate), 0)} °/s, ${way}`;
  return html`<section class="panel view-panel reported" aria-label="Top view"><h2>Top view</h2>
    <svg class="robot-view" viewBox="0 0 200 100" role="img"
      aria-label=${`${robot.label} from above, ahead to the right: ${text}; wheels at ${fixed(angle, 0)} degrees`}>
      <line class="ahead" x1="100" y1="50" x2="194" y2="50" />
      ${car
        ? html`<rect class="hull" x="44" y="26" width="112" height="48" rx="14" />`
        : html`<circle class="hull" cx="100" cy="50" r="44" />`}
      ${wheels(car).map(([x, y, steers]) => html`<rect class="tyre" x="-11" y="-5" width="22" height="10" rx="3"
        transform=${`translate(${x} ${y}) rotate(${steers ? -angle : 0})`} />`)}
      <g class="arrow" transform=${`translate(100 50) rotate(${-angle})`}><path d="M0 0h36l-8-6m8 6l-8 6" /></g>
    </svg>
    <p class="figures">${car
      ? html`<b>${way}</b><span class="soft">asked ${fixed(degrees(rate), 0)} °/s</span>`
      : html`<b>${fixed(degrees(rate), 0)}°</b><span>${way}</span>`}
      <span class="soft">measured ${fixed(degrees(windowOf(robot.i)?.now_radps ?? 0), 0)} °/s, left is positive</span></p>
  </section>`;
}

/**
 * Positions of the wheels, and which of them steer.
 * @param {boolean} car
 * @returns {[number, number, boolean][]}
 */
const wheels = (car) =>
  car
    ? [[66, 24, false], [66, 76, false], [136, 24, true], [136, 76, true]]
    : [[72, 18, false], [72, 82, false], [128, 18, true], [128, 82, true]];
