/** Driving by a gamepad: a shoulder button is the dead-man switch, the left stick steers. */
import { signal } from '../../vendor/preact.js';
import { hold, interrupt, letGo, onRelease } from './hold.js';

const DEAD_ZONE = 0.1;
const DEAD_MAN = [4, 5, 6, 7];

/** Name of the gamepad in use; empty without one. */
export const gamepad = signal('');

/** @param {number} value */
function beyondDeadZone(value) {
  const size = Math.abs(value);
  return size < DEAD_ZONE ? 0 : (Math.sign(value) * (size - DEAD_ZONE)) / (1 - DEAD_ZONE);
}

/** Start driving by gamepad. @returns {() => void} stops it */
export function driveByGamepad() {
  let frame = 0;
  let spent = false;
  let holds = false;
  const look = () => {
    frame = requestAnimationFrame(look);
    const pad = navigator.getGamepads?.().find((one) => one?.connected);
    if (!pad && holds) interrupt('The gamepad was disconnected.');
    gamepad.value = pad?.id ?? '';
    const pressed = Boolean(pad) && DEAD_MAN.some((n) => pad?.buttons[n]?.pressed);
    if (!pressed) spent = false;
    if (pad && pressed && !spent) {
      holds = true;
      const speed = Math.max(0, beyondDeadZone(-pad.axes[1]));
      hold('gamepad', { speed, turn: beyondDeadZone(-pad.axes[0]) });
    } else if (holds) {
      holds = false;
      letGo('gamepad');
    }
  };
  frame = requestAnimationFrame(look);
  const end = onRelease(() => (spent = true));
  return () => {
    cancelAnimationFrame(frame);
    end();
    letGo('gamepad');
  };
}
