/** The successive major axes of the silhouettes on the frame on which people were found (GD96 Fig. 5). */

import { imageColor } from "../widgets/image_colors.js";

/** Opacity of the first approximation; the last one is opaque. */
const FIRST = 0.35;

/**
 * @param {CanvasRenderingContext2D} context
 * @param {import("./pane_view.js").PaneView} view
 * @param {import("../model/store.js").Facts} facts
 * @param {number} camera
 */
export function drawAxes(context, view, { finding, layers, state }, camera) {
  if (!finding || !layers.shown.axes || finding.frame !== state?.frame) return;
  const people = finding.axes.find((axes) => axes.camera === camera)?.people ?? [];
  context.save();
  for (const lines of people) {
    lines.forEach(([u0, v0, u1, v1], round) => {
      const [from, to] = [view.toScreen(u0, v0), view.toScreen(u1, v1)];
      const path = new Path2D();
      path.moveTo(from.x, from.y);
      path.lineTo(to.x, to.y);
      const isLast = round === lines.length - 1;
      context.globalAlpha = layers.opacity.axes * (isLast ? 1 : FIRST + ((1 - FIRST) * round) / lines.length);
      if (isLast) {
        context.strokeStyle = imageColor("outline");
        context.lineWidth = 4;
        context.stroke(path);
      }
      context.strokeStyle = imageColor("mark");
      context.lineWidth = isLast ? 2 : 1.25;
      context.stroke(path);
    });
  }
  context.restore();
}
