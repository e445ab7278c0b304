/** The name under which this tab is known: a reload keeps its seat, another tab has its own. */

const KEY = 'dva-sim-client';

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
