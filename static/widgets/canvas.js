/** Draw texts and clipped areas on a canvas. */

/**
 * Set how the next texts are drawn.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {CanvasTextAlign} textAlign
 * @param {CanvasTextBaseline} textBaseline
 * @param {string} [size] of the font, with its weight
 */
export function setText(context, textAlign, textBaseline, size = "10.5px") {
  Object.assign(context, { font: `${size} system-ui, sans-serif`, textAlign, textBaseline });
}

/**
 * Draw inside a box only.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {{left: number, top: number, right: number, bottom: number}} box
 * @param {() => void} draw
 */
export function drawWithin(context, { left, top, right, bottom }, draw) {
  context.save();
  context.beginPath();
  context.rect(left, top, right - left, bottom - top);
  context.clip();
  draw();
  context.restore();
}
