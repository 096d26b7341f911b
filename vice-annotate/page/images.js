// Decoded frames, the ones used last kept within a number of bytes, the neighbours fetched ahead.

import { getFrame, ServerError } from "./api.js";

/** @typedef {{bitmap: ImageBitmap | null, error: string, bytes: number}} Picture */

const BYTES_A_PIXEL = 4;
const LEAST_KEPT = 4;
const FETCHES_AT_ONCE = 3;

export class Images {
  /** @param {number} budgetBytes of decoded pixels */
  constructor(budgetBytes) {
    this.budgetBytes = budgetBytes;
    this.bytes = 0;
    /** @type {Map<number, Picture>} oldest use first */
    this.kept = new Map();
    /** @type {Map<number, {promise: Promise<Picture>, abort: AbortController}>} */
    this.underway = new Map();
    /** @type {number[]} */
    this.wanted = [];
  }

  /**
   * @param {number} frame
   * @returns {Picture | null} what is decoded already
   */
  peek(frame) {
    const picture = this.kept.get(frame);
    if (!picture) return null;
    this.kept.delete(frame);
    this.kept.set(frame, picture);
    return picture;
  }

  /**
   * @param {number} frame
   * @returns {Promise<Picture>} never fails: a frame that cannot be decoded says why
   */
  async get(frame) {
    return this.peek(frame) ?? this.#fetch(frame).promise;
  }

  /**
   * Fetches these frames when nothing else is under way, the first ones first; what was asked for before and is
   * not among them is dropped.
   * @param {number[]} frames
   */
  prefetch(frames) {
    // Never more than fit: they would push each other, or the shown one, out.
    const each = Math.max(1, this.bytes / Math.max(1, this.kept.size));
    const room = Math.max(2, Math.floor(this.budgetBytes / each) - 2);
    this.wanted = frames.slice(0, room);
    for (const [frame, fetching] of this.underway) {
      if (!this.wanted.includes(frame)) fetching.abort.abort();
    }
    this.#next();
  }

  #next() {
    while (this.underway.size < FETCHES_AT_ONCE) {
      const frame = this.wanted.find((each) => !this.kept.has(each) && !this.underway.has(each));
      if (frame === undefined) return;
      this.#fetch(frame);
    }
  }

  /** @param {number} frame */
  #fetch(frame) {
    const running = this.underway.get(frame);
    if (running && !running.abort.signal.aborted) return running;
    const abort = new AbortController();
    const promise = this.#load(frame, abort.signal).finally(() => {
      if (this.underway.get(frame)?.abort === abort) this.underway.delete(frame);
      this.#next();
    });
    const fetching = { promise, abort };
    this.underway.set(frame, fetching);
    return fetching;
  }

  /**
   * @param {number} frame
   * @param {AbortSignal} signal
   * @returns {Promise<Picture>}
   */
  async #load(frame, signal) {
    try {
      const blob = await getFrame(frame, signal);
      // A data set's PNG may carry a colour profile; labels are of the pixels as stored.
      const bitmap = await createImageBitmap(blob, { colorSpaceConversion: "none" });
      return this.#keep(frame, { bitmap, error: "", bytes: bitmap.width * bitmap.height * BYTES_A_PIXEL });
    } catch (error) {
      if (signal.aborted) return { bitmap: null, error: "not fetched", bytes: 0 };
      const hint = error instanceof ServerError && error.hint ? ` (${error.hint})` : "";
      const message = (error instanceof Error ? error.message : String(error)) + hint;
      const lost = error instanceof ServerError && error.status === 0;
      const picture = { bitmap: null, error: message, bytes: 0 };
      // Where the server is away the frame itself may be fine: asked for again the next time.
      return lost ? picture : this.#keep(frame, picture);
    }
  }

  /**
   * @param {number} frame
   * @param {Picture} picture
   */
  #keep(frame, picture) {
    this.kept.get(frame)?.bitmap?.close();
    this.bytes += picture.bytes - (this.kept.get(frame)?.bytes ?? 0);
    this.kept.delete(frame);
    this.kept.set(frame, picture);
    for (const [oldest, old] of this.kept) {
      if (this.bytes <= this.budgetBytes || this.kept.size <= LEAST_KEPT) break;
      this.kept.delete(oldest);
      this.bytes -= old.bytes;
      old.bitmap?.close();
    }
    return picture;
  }
}
