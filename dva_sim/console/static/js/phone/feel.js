/** Keeps the phone's screen on during a drive, and vibrates. */

const SHAKES = { start: [80], stop: [50, 60, 50], contact: [200], lost: [300, 100, 300] };

/** @param {keyof typeof SHAKES} what */
export function vibrate(what) {
  navigator.vibrate?.(SHAKES[what]);
}

/** @type {any} */
let lock = null;
let wanted = false;

/** @param {boolean} awake true to keep the screen on */
export function keepAwake(awake) {
  wanted = awake;
  if (!awake) {
    lock?.release?.();
    lock = null;
  } else if (!lock) take();
}

/** Request a wake lock. The browser may refuse it, for instance when the battery is low. */
async function take() {
  try {
    const taken = await navigator.wakeLock?.request('screen');
    if (!wanted) return taken?.release();
    lock = taken;
    taken?.addEventListener('release', () => (lock = null));
  } catch {
    lock = null;
  }
  return undefined;
}

document.addEventListener('visibilitychange', () => {
  if (wanted && !document.hidden && !lock) take();
});
