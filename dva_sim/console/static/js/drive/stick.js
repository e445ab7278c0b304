/** Virtual stick for a pointer: up drives forward, and nothing drives in reverse. */
import { html, useEffect, useRef } from '../../vendor/preact.js';
import { hold, letGo, onRelease, wish } from './hold.js';

const REACH = 0.42; // of the pad's size, from its middle

/** @param {{disabled: boolean}} props */
export function Stick({ disabled }) {
  const pad = useRef(/** @type {HTMLElement | null} */ (null));
  const pointer = useRef(/** @type {number | null} */ (null));
  useEffect(() => onRelease(() => (pointer.current = null)), []);
  const move = (/** @type {PointerEvent} */ event) => {
    if (event.pointerId !== pointer.current || !pad.current) return;
    const box = pad.current.getBoundingClientRect();
    const right = (event.clientX - box.left) / box.width - 0.5;
    const up = 0.5 - (event.clientY - box.top) / box.height;
    const limit = (/** @type {number} */ value) => Math.max(-1, Math.min(1, value / REACH));
    hold('stick', { speed: Math.max(0, limit(up)), turn: -limit(right) });
  };
  const down = (/** @type {PointerEvent} */ event) => {
    if (disabled || event.button !== 0) return;
    pad.current?.setPointerCapture(event.pointerId);
    pointer.current = event.pointerId;
    move(event);
  };
  const up = (/** @type {PointerEvent} */ event) => {
    if (event.pointerId !== pointer.current) return;
    pointer.current = null;
    letGo('stick');
  };
  const { speed, turn } = wish.value;
  const shown = (100 * REACH) / Math.max(1, Math.hypot(speed, turn));
  const at = { left: `${50 - shown * turn}%`, top: `${50 - shown * speed}%` };
  return html`<div class=${disabled ? 'stick off' : 'stick'} ref=${pad} aria-hidden="true"
    onPointerDown=${down} onPointerMove=${move} onPointerUp=${up} onPointerCancel=${up}
    onLostPointerCapture=${up}>
    <span class="cross"></span><span class="knob" style=${at}></span>
    <span class="stick-hint">hold</span></div>`;
}
