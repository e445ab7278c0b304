/** Speed and turn rate as sliders that spring back. */
import { html, useEffect, useRef } from '../../vendor/preact.js';
import { Slider } from '../ui/slider.js';
import { hold, letGo, onRelease, wish } from './hold.js';

const DEGREES = 180 / Math.PI;

/** @param {number} value [m/s] */
const speedText = (value) => `${value.toFixed(2)} m/s`;

/** @param {number} value [degrees/s], to the left positive */
function turnText(value) {
  const side = value > 0.5 ? ' left' : value < -0.5 ? ' right' : '';
  return `${Math.round(Math.abs(value))} °/s${side}`;
}

/**
 * Both, for robots with these limits.
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
 * A slider wants something while a pointer or a key holds it. A value that came otherwise, as from
 * assistive technology, counts while the slider has the focus and the page can be seen.
 * @param {string} source
 */
function useSpring(source) {
  const pressed = useRef(false);
  useEffect(() => {
    const end = onRelease(() => (pressed.current = false));
    return () => {
      end();
      letGo(source);
    };
  }, [source]);
  const press = () => (pressed.current = true);
  const release = () => {
    if (!pressed.current) return;
    pressed.current = false;
    letGo(source);
  };
  const keyUp = (/** @type {KeyboardEvent} */ event) => {
    if (event.key !== 'Tab' && event.key !== 'Shift') release();
  };
  const blur = () => {
    pressed.current = false;
    letGo(source);
  };
  return {
    want: (/** @type {import('./hold.js').Wish} */ wanted) => {
      if (document.hasFocus() || !document.hidden) hold(source, wanted);
    },
    more: {
      onPointerDown: press,
      onPointerUp: release,
      onPointerCancel: release,
      onLostPointerCapture: release,
      onKeyDown: (/** @type {KeyboardEvent} */ event) => event.key !== 'Tab' && press(),
      onKeyUp: keyUp,
      onBlur: blur,
    },
  };
}
