/**
 * The images of the frames that came last, reduced and ready to be drawn, bounded in bytes: to decode them anew would take as long as
 * whoever waits for a frame can be kept waiting.
 */

import { keyOf } from "./pictures.js";

/** Of four panes in a window of 1280x720 some hundred frames. */
const MAX_BYTES = 64 * 2 ** 20;
const BYTES_PER_PIXEL = 4;
/** Of the size that they are shown at, along either side: enough to find one's way. */
const SHARE = 0.6;

export class RecentImages {
  /** @type {Map<number, {images: Map<number, OffscreenCanvas>, bytes: number}>} images by camera, by frame, the latest last */
  #frames = new Map();
  #bytes = 0;

  /**
   * Keep the images among the pictures of a frame.
   *
   * @param {number} frame
   * @param {import("./pictures.js").Pictures} pictures
   */
  keep(frame, pictures) {
    const kept = this.#frames.get(frame) ?? { images: new Map(), bytes: 0 };
    for (const [key, { bitmap }] of pictures) {
      const [layer, camera] = key.split(" ");
      if (layer !== "image") continue;
      const image = reduced(bitmap);
      const change = bytesOf(image) - bytesOf(kept.images.get(Number(camera)));
      kept.images.set(Number(camera), image);
      kept.bytes += change;
      this.#bytes += change;
    }
    if (kept.images.size === 0) return;
    this.#touch(frame, kept);
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
   * The images of a frame, which are kept longer than all others from now on.
   *
   * @param {number} frame
   * @returns {import("./store.js").PlaceholderPictures}
   */
  of(frame) {
    const kept = this.#frames.get(frame);
    if (!kept) return new Map();
    this.#touch(frame, kept);
    return new Map([...kept.images].map(([camera, bitmap]) => [keyOf("image", camera), { bitmap, limitPx: null }]));
  }

  /**
   * @param {number} frame
   * @param {{images: Map<number, OffscreenCanvas>, bytes: number}} kept
   */
  #touch(frame, kept) {
    this.#frames.delete(frame);
    this.#frames.set(frame, kept);
  }
}

/** @param {OffscreenCanvas | undefined} image */
function bytesOf(image) {
  return image ? image.width * image.height * BYTES_PER_PIXEL : 0;
}

/**
 * A canvas, since Chromium takes seconds for whatever comes after some two hundred bitmaps where no graphics card draws them.
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
