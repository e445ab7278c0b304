/** Socket that carries the person's input to the simulation. */

/** @type {WebSocket | null} */
let drive = null;

/** @param {WebSocket | null} socket */
export function replaceDriveSocket(socket) {
  const old = drive;
  drive = socket;
  old?.close();
}

/** Bytes queued in the browser and not sent yet [B]. */
export const backlog = () => drive?.bufferedAmount ?? 0;

/** @param {WebSocket} socket */
export const isDriveSocket = (socket) => socket === drive;

/**
 * Send on the socket for driving.
 * @param {object} message
 * @returns {boolean} true if it was sent
 */
export function steer(message) {
  if (drive?.readyState !== WebSocket.OPEN) return false;
  drive.send(JSON.stringify(message));
  return true;
}
