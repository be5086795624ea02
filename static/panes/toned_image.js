/** Apply a tone curve to an image, once for each picture and tone. */

import { isPlain, toneCurve } from "../model/image_tone.js";

export class TonedImage {
  /** @type {ImageBitmap | OffscreenCanvas | null} */
  #source = null;
  /** @type {import("../model/image_tone.js").ImageTone | null} */
  #tone = null;
  /** @type {OffscreenCanvas | null} */
  #canvas = null;

  /**
   * @param {ImageBitmap | OffscreenCanvas} bitmap
   * @param {import("../model/image_tone.js").ImageTone | undefined} tone
   * @returns {CanvasImageSource & {width: number, height: number}} the bitmap itself if the tone is plain
   */
  of(bitmap, tone) {
    if (!tone || isPlain(tone)) {
      this.#source = this.#tone = this.#canvas = null;
      return bitmap;
    }
    if (bitmap === this.#source && tone === this.#tone && this.#canvas) return this.#canvas;
    [this.#source, this.#tone] = [bitmap, tone];
    this.#canvas = tonedImage(bitmap, toneCurve(tone));
    return this.#canvas;
  }
}

/**
 * @param {ImageBitmap | OffscreenCanvas} bitmap
 * @param {Uint8ClampedArray} curve
 */
function tonedImage(bitmap, curve) {
  const { width, height } = bitmap;
  const canvas = new OffscreenCanvas(width, height);
  const context = /** @type {OffscreenCanvasRenderingContext2D} */ (canvas.getContext("2d", { willReadFrequently: true }));
  context.drawImage(bitmap, 0, 0);
  const pixels = context.getImageData(0, 0, width, height);
  const { data } = pixels;
  for (let i = 0; i < data.length; i += 4) {
    data[i] = curve[data[i]];
    data[i + 1] = curve[data[i + 1]];
    data[i + 2] = curve[data[i + 2]];
  }
  context.putImageData(pixels, 0, 0);
  return canvas;
}
