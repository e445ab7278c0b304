/** Speed and turn rate as sliders that spring back. */
import { html, useEffect, useRef, useState } from '../../vendor/preact.js';
import { Slider } from '../ui/slider.js';
import { hold, letGo, onRelease, wish } from './hold.js';

const DEGREES = 180 / Math.PI;
const MOVES = /^(Arrow|Page|Home|End)/; // keys that move a slider

/** @param {number} value [m/s] */
const speedText = (value) => `${value.toFixed(2)} m/s`;

/** @param {number} value [degrees/s], to the left positive */
function turnText(value) {
  const side = value > 0.5 ? ' left' : value < -0.5 ? ' right' : '';
  return `${Math.round(Math.abs(value))} °/s${side}`;
}

/**
 * Sliders for speed and turn rate, scaled to the robots' limits.
 * @param {{limits: {max_speed_mps: number, max_turn_rate_radps: number}, disabled: boolean}} props
 */
export function DriveSliders({ limits, disabled }) {
  const fastest = limits.max_speed_mps;
  const sharpest = Math.round(limits.max_turn_rate_radps * DEGREES);
  const { speed, turn } = wish.value;
  const speedHeld = useSpring('slider-speed');
  const turnHeld = useSpring('slider-turn');
  return html`<div class="drive-sliders">
    <${Slider} name="Speed" min=${0} max=${fastest} step=${0.01} disabled=${disabled}
      value=${Number((speed * fastest).toFixed(2))} text=${speedText} more=${speedHeld.more}
      onInput=${(/** @type {number} */ v) => speedHeld.want({ speed: v / fastest, turn: wish.peek().turn })} />
    <${Slider} name="Turn rate" min=${-sharpest} max=${sharpest} step=${1} rtl disabled=${disabled}
      value=${Math.round(turn * sharpest)} text=${turnText} more=${turnHeld.more}
      onInput=${(/** @type {number} */ v) => turnHeld.want({ speed: wish.peek().speed, turn: v / sharpest })} />
  </div>`;
}

/**
 * Handlers of a slider that is active while a pointer or a key holds it. A value set in another
 * way, for instance by assistive technology, applies until the slider loses the focus. After an
 * interruption a grip that continues is ignored until it is released.
 * @param {string} source
 */
function useSpring(source) {
  const grip = useRef('');
  const spent = useRef(false);
  const [, showZero] = useState(0);
  useEffect(() => {
    const end = onRelease(() => (spent.current = Boolean(grip.current)));
    return () => {
      end();
      letGo(source);
    };
  }, [source]);
  const grasp = (/** @type {string} */ by) => () => {
    grip.current = by;
    spent.current = false;
  };
  const open = (/** @type {string} */ by) => () => {
    if (grip.current !== by) return;
    grip.current = '';
    spent.current = false;
    letGo(source);
  };
  const keyDown = (/** @type {KeyboardEvent} */ event) => {
    if (MOVES.test(event.key) && !event.repeat) grasp('key')();
  };
  const keyUp = (/** @type {KeyboardEvent} */ event) => {
    if (MOVES.test(event.key)) open('key')();
  };
  const blur = () => {
    grip.current = '';
    spent.current = false;
    letGo(source);
  };
  return {
    want: (/** @type {import('./hold.js').Wish} */ wanted) => {
      if (spent.current) showZero((n) => n + 1); // the browser has moved the knob: put it back
      else if (document.hasFocus() || !document.hidden) hold(source, wanted);
    },
    more: {
      onPointerDown: grasp('pointer'),
      onPointerUp: open('pointer'),
      onPointerCancel: open('pointer'),
      onLostPointerCapture: open('pointer'),
      onKeyDown: keyDown,
      onKeyUp: keyUp,
      onBlur: blur,
    },
  };
}
