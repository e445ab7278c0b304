/** The way on which the person's hand reaches the world. */

/** @type {WebSocket | null} */
let drive = null;

/** @param {WebSocket | null} socket */
export function replaceDriveSocket(socket) {
  const old = drive;
  drive = socket;
  old?.close();
}

/** What waits in the browser and has not been sent yet [B]. */
export const backlog = () => drive?.bufferedAmount ?? 0;

/** @param {WebSocket} socket */
export const isDriveSocket = (socket) => socket === drive;

/**
 * Send on the socket for driving.
 * @param {object} message
 * @returns {boolean} whether it went out
 */
export function steer(message) {
  if (drive?.readyState !== WebSocket.OPEN) return false;
  drive.send(JSON.stringify(message));
  return true;
}
