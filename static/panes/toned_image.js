/** Apply a tone curve to an image, once for each picture and tone. */

import { isPlain, toneCurve } from "../model/image_tone.js";

/**
 * @typedef {ImageBitmap | OffscreenCanvas} Bitmap
 * @typedef {import("../model/image_tone.js").ImageTone} ImageTone
 */

/** Returns a function that applies a tone to a bitmap, and returns the bitmap itself if the tone is plain. */
export function makeTonedImage() {
  /** @type {{bitmap: Bitmap, tone: ImageTone, image: OffscreenCanvas} | null} */
  let last = null;
  return (/** @type {Bitmap} */ bitmap, /** @type {ImageTone | undefined} */ tone) => {
    if (!tone || isPlain(tone)) last = null;
    else if (bitmap !== last?.bitmap || tone !== last.tone) last = { bitmap, tone, image: tonedImage(bitmap, toneCurve(tone)) };
    return last?.image ?? bitmap;
  };
}

/**
 * @param {Bitmap} bitmap
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
