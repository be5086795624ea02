/**
 * Cache of reduced images of recent frames, bounded in bytes. They are shown until a requested frame arrives, so they must
 * not need decoding.
 */

import { keyOf } from "./pictures.js";

/** About a hundred frames of four panes in a window of 1280x720. */
const MAX_BYTES = 64 * 2 ** 20;
const BYTES_PER_PIXEL = 4;
/** Size relative to the displayed image, per side. */
const SHARE = 0.6;

export class RecentImages {
  /** @type {Map<number, {images: Map<number, OffscreenCanvas>, bytes: number}>} images by camera, by frame, newest last */
  #frames = new Map();
  #bytes = 0;

  /**
   * Cache the images among the pictures of a frame.
   *
   * @param {number} frame
   * @param {import("./pictures.js").Pictures} pictures
   */
  keep(frame, pictures) {
    const entry = this.#frames.get(frame) ?? { images: new Map(), bytes: 0 };
    for (const [key, { bitmap }] of pictures) {
      const [layer, camera] = key.split(" ");
      if (layer !== "image") continue;
      const image = reduced(bitmap);
      const change = bytesOf(image) - bytesOf(entry.images.get(Number(camera)));
      entry.images.set(Number(camera), image);
      entry.bytes += change;
      this.#bytes += change;
    }
    if (entry.images.size === 0) return;
    this.#touch(frame, entry);
    for (const [oldest, { bytes }] of this.#frames) {
      if (this.#bytes <= MAX_BYTES || oldest === frame) break;
      this.#frames.delete(oldest);
      this.#bytes -= bytes;
    }
  }

  clear() {
    this.#frames.clear();
    this.#bytes = 0;
  }

  /**
   * The nearest frame that has cached images of some cameras.
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
   * Images of a frame. They become the newest of the cache.
   *
   * @param {number} frame
   * @returns {import("./store.js").PlaceholderPictures}
   */
  of(frame) {
    const entry = this.#frames.get(frame);
    if (!entry) return new Map();
    this.#touch(frame, entry);
    return new Map([...entry.images].map(([camera, bitmap]) => [keyOf("image", camera), { bitmap, limitPx: null }]));
  }

  /**
   * @param {number} frame
   * @param {{images: Map<number, OffscreenCanvas>, bytes: number}} entry
   */
  #touch(frame, entry) {
    this.#frames.delete(frame);
    this.#frames.set(frame, entry);
  }
}

/** @param {OffscreenCanvas | undefined} image */
function bytesOf(image) {
  return image ? image.width * image.height * BYTES_PER_PIXEL : 0;
}

/**
 * Reduce an image. A canvas, because Chromium becomes slow with more than 200 bitmaps in software rendering.
 *
 * @param {ImageBitmap} bitmap
 */
function reduced(bitmap) {
  const [width, height] = [bitmap.width, bitmap.height].map((n) => Math.max(1, Math.round(SHARE * n)));
  const canvas = new OffscreenCanvas(width, height);
  const context = /** @type {OffscreenCanvasRenderingContext2D} */ (canvas.getContext("2d", { willReadFrequently: true }));
  context.drawImage(bitmap, 0, 0, width, height);
  return canvas;
}
