/** Reads a camera's stream part by part, for the times that an `<img>` would hide. */

const HEAD_END = [13, 10, 13, 10];
const WAIT_MS = 1000;
const NO_CAMERA = 204; // the status of a robot that states no camera

/**
 * @typedef {{bitmap: ImageBitmap, number: number, capturedMs: number, bytes: number}} Frame
 */

/**
 * Read a stream until `signal` aborts; reconnect when it ends.
 * @param {string} url
 * @param {(frame: Frame) => void} show
 * @param {(text: string) => void} tell reports a problem; an empty text clears it
 * @param {AbortSignal} signal
 */
export async function play(url, show, tell, signal) {
  while (!signal.aborted) {
    try {
      const answer = await fetch(url, { signal, cache: 'no-store' });
      if (answer.status === NO_CAMERA) throw new Error('This robot offers no picture.');
      if (!answer.ok || !answer.body) throw new Error(await reasonOf(answer));
      tell('');
      await readParts(answer.body.getReader(), show, signal);
      tell('The stream ended. Reconnecting …');
    } catch (error) {
      if (signal.aborted) return;
      tell(error instanceof Error ? error.message : `${error}`);
    }
    await new Promise((later) => window.setTimeout(later, WAIT_MS));
  }
}

/** Reason that the server gives for a missing picture. @param {Response} answer */
async function reasonOf(answer) {
  const { text } = await answer.json().catch(() => ({}));
  return text || `No picture: the server answered ${answer.status}`;
}

/**
 * @param {ReadableStreamDefaultReader<Uint8Array>} reader
 * @param {(frame: Frame) => void} show
 * @param {AbortSignal} signal
 */
async function readParts(reader, show, signal) {
  const buffer = new Buffer();
  while (!signal.aborted) {
    const { value, done } = await reader.read();
    if (done) return;
    buffer.add(value);
    let newest = null;
    for (let part = buffer.take(); part; part = buffer.take()) newest = part;
    if (newest) show(await decoded(newest));
  }
}

/** @param {{head: Record<string, string>, body: Uint8Array}} part */
async function decoded({ head, body }) {
  const blob = new Blob([/** @type {any} */ (body)], { type: 'image/jpeg' });
  return {
    bitmap: await createImageBitmap(blob),
    number: Number(head['x-frame-number'] ?? NaN),
    capturedMs: Number(head['x-frame-time-ms'] ?? NaN),
    bytes: body.length,
  };
}

/** Bytes received so far, cut into complete parts. */
export class Buffer {
  constructor() {
    this.bytes = new Uint8Array(0);
  }

  /** @param {Uint8Array} more */
  add(more) {
    const all = new Uint8Array(this.bytes.length + more.length);
    all.set(this.bytes);
    all.set(more, this.bytes.length);
    this.bytes = all;
  }

  /** Remove and return the next complete part, or null. */
  take() {
    const end = indexOf(this.bytes, HEAD_END);
    if (end < 0) return null;
    const head = headers(new TextDecoder('latin1').decode(this.bytes.subarray(0, end)));
    const from = end + HEAD_END.length;
    const length = Number(head['content-length'] ?? 0);
    if (this.bytes.length < from + length) return null;
    const body = this.bytes.slice(from, from + length);
    this.bytes = this.bytes.slice(from + length);
    return { head, body };
  }
}

/**
 * @param {Uint8Array} bytes
 * @param {number[]} wanted
 */
function indexOf(bytes, wanted) {
  for (let n = 0; n + wanted.length <= bytes.length; n += 1) {
    if (wanted.every((byte, m) => bytes[n + m] === byte)) return n;
  }
  return -1;
}

/** @param {string} text */
function headers(text) {
  const lines = text.split('\r\n').map((line) => line.split(':'));
  const pairs = lines.filter((line) => line.length > 1);
  return /** @type {Record<string, string>} */ (
    Object.fromEntries(pairs.map(([name, ...value]) => [name.trim().toLowerCase(), value.join(':').trim()]))
  );
}
