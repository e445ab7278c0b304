/** Position of the guard by satellite; only for sites with geographic coordinates. */
import { effect, signal } from '../../vendor/preact.js';
import { guard, notice, scene } from '../store.js';
import { act } from '../net/actions.js';

const EARTH_M = 6371008.8; // mean radius (IUGG)
const RADIANS = Math.PI / 180;
const ROOM_M = 50; // around the site
const EVERY_MS = 2000;

/** True while the browser's position is used. */
export const locating = signal(false);

/** True if both the browser and the site support positioning. */
export const canLocate = () =>
  window.isSecureContext && 'geolocation' in navigator && Boolean(scene.peek()?.site.origin);

/**
 * Convert a geographic position to site coordinates [m], on the plane tangent at the origin.
 * @param {{latitude: number, longitude: number}} place [degrees]
 * @param {{latitude_deg: number, longitude_deg: number}} origin
 */
export function metres({ latitude, longitude }, origin) {
  const north = (latitude - origin.latitude_deg) * RADIANS * EARTH_M;
  const east = (longitude - origin.longitude_deg) * RADIANS * EARTH_M;
  return [east * Math.cos(origin.latitude_deg * RADIANS), north];
}

/** Send the guard's position while `locating` is set. @returns {() => void} stops it */
export function follow() {
  let lastSent = -Infinity;
  const take = (/** @type {GeolocationPosition} */ found) => {
    const site = scene.peek()?.site;
    if (!site?.origin || !guard.peek() || performance.now() - lastSent < EVERY_MS) return;
    const [x, y] = metres(found.coords, site.origin);
    const [xmin, ymin, xmax, ymax] = site.extent_m;
    if (x < xmin - ROOM_M || x > xmax + ROOM_M || y < ymin - ROOM_M || y > ymax + ROOM_M) {
      locating.value = false;
      notice.value = 'You are not at this scenario’s site. Tap the map instead.';
      return;
    }
    lastSent = performance.now();
    act('guard_place', { x_m: x, y_m: y });
  };
  const fail = (/** @type {GeolocationPositionError} */ error) => {
    locating.value = false;
    notice.value = `No position by satellite: ${error.message || 'it was not allowed'}. Tap the map instead.`;
  };
  const end = effect(() => {
    if (!locating.value) return undefined;
    const watch = navigator.geolocation.watchPosition(take, fail, { enableHighAccuracy: true });
    return () => navigator.geolocation.clearWatch(watch);
  });
  return () => {
    end();
    locating.value = false;
  };
}
