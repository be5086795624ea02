/** Elements of the page, and canvases at the resolution of the screen. */

import { prepare } from "../widgets/canvas.js";

/**
 * Return the element of an id.
 *
 * @template {HTMLElement} [T=HTMLElement]
 * @param {string} id
 * @returns {T}
 */
export const byId = (id) => /** @type {T} */ (document.getElementById(id));

/**
 * Clear a canvas and return its context, in CSS pixels, with its size; null while it is not shown.
 *
 * @param {HTMLCanvasElement} canvas
 * @returns {{ context: CanvasRenderingContext2D, width: number, height: number } | null}
 */
export const begin = (canvas) => {
  const { clientWidth: width, clientHeight: height } = canvas;
  return width && height ? { context: prepare(canvas, width, height, false), width, height } : null;
};

/**
 * Return a colour of the present scheme.
 *
 * @param {string} name of a token, such as `--text`
 */
export const token = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
