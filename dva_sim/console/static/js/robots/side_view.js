/** Side view of the robot: its wheels turn at the commanded speed, and only forward. */
import { html, useEffect, useRef } from '../../vendor/preact.js';
import { fixed, windowOf } from './window.js';

const TURN = 360;

/** @typedef {import('../lines.js').Thing} Thing */

/** @param {{robot: Thing}} props */
export function SideView({ robot }) {
  const speed = windowOf(robot.i)?.speed_mps ?? 0;
  const radius = robot.wheel_radius_m ?? 0.1;
  const spin = speed / radius;
  const text = `${fixed(speed, 2)} m/s, wheels ${fixed(spin, 2)} rad/s`;
  const model = isModelCar(robot);
  return html`<section class="panel view-panel reported" aria-label="Side view"><h2>Side view</h2>
    <svg class="robot-view" viewBox="0 0 200 100" role="img" aria-label=${`${robot.label} from the side, driving to the right: ${text}`}>
      <line class="ground" x1="4" y1="90" x2="196" y2="90" />
      <path class="hull" d=${model ? CAR : SERVICE} />
      ${!model && html`<circle class="valve" cx="114" cy="22" r="4" />`}
      <path class="arrow" d="M168 20h18l-6-5m6 5l-6 5" />
      <${Wheel} x=${model ? 56 : 62} spin=${spin} /><${Wheel} x=${model ? 144 : 138} spin=${spin} />
    </svg>
    <p class="figures"><b>${fixed(speed, 2)} m/s</b>
      ${model && html`<span>motor ${duty(robot)} % PWM</span>`}
      <span>wheels ${fixed(spin, 2)} rad/s = v / ${radius} m</span>
      <span class="soft">measured ${fixed(windowOf(robot.i)?.now_mps ?? 0, 2)} m/s</span></p>
  </section>`;
}

const SERVICE = 'M38 78V58q0-6 6-6h32l5-30q1-12 13-12h22q9 0 9 9v33h31q6 0 6 6v20z';
const CAR = 'M24 76q-2-16 12-20l30-6 22-18h34l20 20 30 6q8 4 6 18z';

/** True for a model car, which steers only left, straight and right. @param {Thing} robot */
export const isModelCar = (robot) => robot.steering === 'three_way';

/** @param {Thing} robot */
const duty = (robot) => Math.round((100 * (windowOf(robot.i)?.speed_mps ?? 0)) / (robot.max_speed_mps ?? Infinity));

const still = window.matchMedia('(prefers-reduced-motion: reduce)');

/** @param {{x: number, spin: number}} props spin in rad/s, ahead */
function Wheel({ x, spin }) {
  const spokes = useRef(/** @type {SVGGElement | null} */ (null));
  const wanted = useRef(spin);
  wanted.current = Math.max(0, spin);
  useEffect(() => {
    let angle = 0;
    let then = performance.now();
    let frame = window.requestAnimationFrame(turn);
    function turn(/** @type {number} */ now) {
      if (wanted.current > 0 && !still.matches) {
        angle = (angle + ((now - then) / 1000) * wanted.current * (180 / Math.PI)) % TURN;
        spokes.current?.setAttribute('transform', `rotate(${angle.toFixed(1)})`);
      }
      then = now;
      frame = window.requestAnimationFrame(turn);
    }
    return () => window.cancelAnimationFrame(frame);
  }, []);
  return html`<g transform=${`translate(${x} 76)`}><circle class="tyre" r="14" />
    <g class="spokes" ref=${spokes}><path d="M0-11V11M-11 0H11" /><circle class="valve" cx="0" cy="-8" r="2.2" /></g></g>`;
}
