/** The name under which this tab is known: a reload keeps its seat, another tab has its own. */

const KEY = 'dva-sim-client';

/**
 * This page, until it is loaded anew: by it the server knows one that comes back before its old
 * connection is known to be dead, from a copy of the tab, which has the same name in its storage.
 */
export const PAGE = Array.from(crypto.getRandomValues(new Uint8Array(8)), (byte) =>
  byte.toString(16).padStart(2, '0'),
).join('');

/** @param {string} client */
export function rememberClient(client) {
  try {
    sessionStorage.setItem(KEY, client);
  } catch {
    // Without storage a reload is somebody new.
  }
}

/** The name before the reload; empty at first. */
export function rememberedClient() {
  try {
    return sessionStorage.getItem(KEY) ?? '';
  } catch {
    return '';
  }
}
