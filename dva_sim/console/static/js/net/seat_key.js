/** The key of this tab's seat: with it a reload keeps the seat; another tab has its own. */

const KEY = 'dva-sim-seat-key';

/**
 * This page, until it is loaded again: by it the server knows one that comes back before its old
 * connection is known to be dead, from a copy of the tab, which has the same key in its storage.
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
