/** Lines that are measured in the pictures, and are no part of a pose: axes of silhouettes, epipolar lines, misfits. */

import { shownMisfits } from "../model/selectors.js";
import { addLine } from "../widgets/canvas.js";
import { imageColor } from "../widgets/image_colors.js";
import { LINE_STYLES, stroke } from "./drawing.js";

/** Opacity of the first approximation; the last one is opaque. */
const FIRST = 0.35;
/** Half side of a cross on a clicked place. */
const CROSS_PX = 6;
/** Length of the head of an arrow, and half its angle, rad. */
const [HEAD_PX, HEAD_RAD] = [6, 0.45];

/**
 * Draw the successive major axes of the silhouettes on the frame on which people were found (GD96 Fig. 5).
 *
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
      const path = addLine(new Path2D(), view.toScreen(u0, v0), view.toScreen(u1, v1));
      const isLast = round === lines.length - 1;
      context.globalAlpha = layers.opacity.axes * (isLast ? 1 : FIRST + ((1 - FIRST) * round) / lines.length);
      stroke(context, path, imageColor("mark"), isLast ? 2 : 1.25, isLast);
    });
  }
  context.restore();
}

/**
 * Draw the lines of the epipolar check in one view, and crosses on the places that were clicked.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {import("./pane_view.js").PaneView} view
 * @param {import("../model/store.js").Facts} facts
 * @param {number} camera
 */
export function drawEpipolar(context, view, { epipolar, epipolarLines }, camera) {
  if (!epipolar) return;
  const path = new Path2D();
  for (const line of epipolarLines?.lines ?? []) {
    if (line.camera !== camera) continue;
    addLine(path, view.toScreen(line.x0, line.y0), view.toScreen(line.x1, line.y1));
  }
  for (const point of epipolar.kept) {
    if (point.camera !== camera) continue;
    const { x, y } = view.toScreen(point.u, point.v);
    for (const dy of [CROSS_PX, -CROSS_PX]) addLine(path, { x: x - CROSS_PX, y: y - dy }, { x: x + CROSS_PX, y: y + dy });
  }
  stroke(context, path, imageColor("mark"), LINE_STYLES.epipolar.width, true);
}

/**
 * Draw where the contours of the last check miss the edges in one view: arrows that begin at the contours.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {import("./pane_view.js").PaneView} view
 * @param {import("../model/store.js").Facts} facts
 * @param {number} camera
 */
export function drawMisfits(context, view, facts, camera) {
  const factor = facts.calibration?.misfit_factor ?? 1;
  const lines = new Path2D();
  for (const { camera: of, u, v, du, dv } of shownMisfits(facts)) {
    if (of !== camera) continue;
    const [from, to] = [view.toScreen(u, v), view.toScreen(u + factor * du, v + factor * dv)];
    addLine(lines, from, to);
    const [way, length] = [Math.atan2(to.y - from.y, to.x - from.x), Math.hypot(to.x - from.x, to.y - from.y)];
    for (const side of [HEAD_RAD, -HEAD_RAD]) {
      const head = Math.min(HEAD_PX, length);
      addLine(lines, to, { x: to.x - head * Math.cos(way + side), y: to.y - head * Math.sin(way + side) });
    }
  }
  stroke(context, lines, imageColor("mark"), 1.75, true);
}
