/** The images of the frames that came last, as they came: compressed, outside of the page's heap, bounded in bytes. */

import { keyOf } from "./pictures.js";

/** Of four 640x480 views some three hundred frames. */
const MOST_BYTES = 64 * 2 ** 20;

export class RecentImages {
  /** @type {Map<number, {images: Map<number, Blob>, bytes: number}>} images by camera, by frame, the latest last */
  #frames = new Map();
  #bytes = 0;

  /**
   * Keep the images among the pictures of a frame.
   *
   * @param {number} frame
   * @param {Map<string, import("./pictures.js").Arrived>} arrived
   */
  keep(frame, arrived) {
    const kept = this.#frames.get(frame) ?? { images: new Map(), bytes: 0 };
    for (const { header, blob } of arrived.values()) {
      if (header.layer !== "image") continue;
      const change = blob.size - (kept.images.get(header.camera)?.size ?? 0);
      kept.images.set(header.camera, blob);
      kept.bytes += change;
      this.#bytes += change;
    }
    if (kept.images.size === 0) return;
    this.#frames.delete(frame);
    this.#frames.set(frame, kept);
    for (const [oldest, { bytes }] of this.#frames) {
      if (this.#bytes <= MOST_BYTES || oldest === frame) break;
      this.#frames.delete(oldest);
      this.#bytes -= bytes;
    }
  }

  clear() {
    this.#frames.clear();
    this.#bytes = 0;
  }

  /**
   * The frame nearest to another of which the images of some cameras are kept, and the one itself where they are.
   *
   * @param {number} frame
   * @param {number[]} cameras
   * @returns {number | null}
   */
  nearest(frame, cameras) {
    let [best, distance] = [/** @type {number | null} */ (null), Infinity];
    for (const [at, { images }] of this.#frames) {
      if (Math.abs(at - frame) >= distance || !cameras.every((camera) => images.has(camera))) continue;
      [best, distance] = [at, Math.abs(at - frame)];
    }
    return best;
  }

  /**
   * Decode the images of a frame; whoever asks closes the bitmaps.
   *
   * @param {number} frame
   * @param {number[]} cameras
   * @returns {Promise<import("./pictures.js").Pictures>}
   */
  async decode(frame, cameras) {
    const images = this.#frames.get(frame)?.images;
    const decoded = cameras.map(async (camera) => {
      const bitmap = await createImageBitmap(/** @type {Blob} */ (images?.get(camera)));
      return /** @type {[string, import("./pictures.js").Picture]} */ ([keyOf("image", camera), { bitmap, limitPx: null }]);
    });
    return new Map(await Promise.all(decoded));
  }
}
