/** Draw texts, simple shapes and clipped areas on a canvas. */

/**
 * Resize a canvas to its pane in device pixels. Return its cleared context, scaled to CSS pixels.
 *
 * @param {HTMLCanvasElement} canvas
 * @param {number} width
 * @param {number} height
 * @param {boolean} onProcessor whether to draw on the processor, which is faster for many short lines that change each
 *   time, especially without a graphics card
 */
export function prepare(canvas, width, height, onProcessor) {
  const ratio = devicePixelRatio;
  const [deviceWidth, deviceHeight] = [Math.round(width * ratio), Math.round(height * ratio)];
  if (canvas.width !== deviceWidth || canvas.height !== deviceHeight) {
    canvas.width = deviceWidth;
    canvas.height = deviceHeight;
  }
  const context = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d", { willReadFrequently: onProcessor }));
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  return context;
}

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
 * Fill a rectangle.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {string | CanvasPattern} color
 * @param {number} x
 * @param {number} y
 * @param {number} width
 * @param {number} height
 * @param {number} [opacity]
 */
export function fillRect(context, color, x, y, width, height, opacity = 1) {
  context.fillStyle = color;
  context.globalAlpha = opacity;
  context.fillRect(x, y, width, height);
  context.globalAlpha = 1;
}

/**
 * Add a straight line to a path.
 *
 * @param {Path2D} path
 * @param {{x: number, y: number}} from
 * @param {{x: number, y: number}} to
 */
export function addLine(path, from, to) {
  path.moveTo(from.x, from.y);
  path.lineTo(to.x, to.y);
  return path;
}

/**
 * Make the path of a diamond.
 *
 * @param {number} x middle
 * @param {number} y
 * @param {number} radius
 */
export function diamondPath(x, y, radius) {
  return new Path2D(`M${x} ${y - radius}L${x + radius} ${y}L${x} ${y + radius}L${x - radius} ${y}Z`);
}

/**
 * Make the path of a circle.
 *
 * @param {number} x middle
 * @param {number} y
 * @param {number} radius
 */
export function circlePath(x, y, radius) {
  const path = new Path2D();
  path.arc(x, y, radius, 0, 2 * Math.PI);
  return path;
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
