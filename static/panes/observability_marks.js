/** Rings around joints: how well the cameras constrain them. */

import { imageColor } from "../widgets/image_colors.js";

const RADIUS = 11;
/** Distance of the second ring of a joint that is not observable. */
const SECOND_RING = 3.5;
/** Colour and dash of each level; the shape differs too. */
const STYLES = /** @type {const} */ ({
  known: { color: "good", dash: [], rings: 1 },
  weak: { color: "warning", dash: [4, 3], rings: 1 },
  unknown: { color: "off", dash: [], rings: 2 },
});

/**
 * @param {CanvasRenderingContext2D} context
 * @param {{x: number, y: number}} at
 * @param {import("../model/observability.js").Level} level
 * @param {number} opacity
 */
export function drawObservability(context, { x, y }, level, opacity) {
  const { color, dash, rings } = STYLES[level];
  const path = new Path2D();
  for (let ring = 0; ring < rings; ring++) {
    const radius = RADIUS + ring * SECOND_RING;
    path.moveTo(x + radius, y);
    path.arc(x, y, radius, 0, 2 * Math.PI);
  }
  context.save();
  context.globalAlpha = opacity;
  context.strokeStyle = imageColor("outline");
  context.lineWidth = 3.5;
  context.stroke(path);
  context.setLineDash(dash);
  context.strokeStyle = imageColor(color);
  context.lineWidth = 1.75;
  context.stroke(path);
  context.restore();
}
