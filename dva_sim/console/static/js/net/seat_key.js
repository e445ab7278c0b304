/** The key of this tab's seat: with it a reload keeps the seat; another tab has its own. */

const KEY = 'dva-sim-seat-key';

/**
 * ID of this page until it is reloaded. A page may reconnect before its old connection is found to be
 * dead; the ID distinguishes it from a copy of the tab, which has the same key in its storage.
 */
export const PAGE = Array.from(crypto.getRandomValues(new Uint8Array(8)), (byte) =>
  byte.toString(16).padStart(2, '0'),
).join('');

/** @param {string} key */
export function rememberKey(key) {
  try {
    sessionStorage.setItem(KEY, key);
  } catch {
    // Without storage a reload is a new page.
  }
}

/** The key before the reload; empty at first. */
export function rememberedKey() {
  try {
    return sessionStorage.getItem(KEY) ?? '';
  } catch {
    return '';
  }
}
