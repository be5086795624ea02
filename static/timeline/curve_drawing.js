/** Draw plots of curves below one another, on the axis of the timeline. Sizes are CSS pixels. */

import { circlePath, drawWithin, fillRect, setText } from "../widgets/canvas.js";
import { drawValues, toY } from "../widgets/plot.js";
import { SOURCES, keyframesOf } from "../model/cells.js";
import { extent, trace } from "../model/series.js";
import { colorName, dashOf } from "../widgets/series_lines.js";
import { drawDiamond } from "./cell_marks.js";
import { markPositions } from "./timeline_drawing.js";

/**
 * @typedef {import("../widgets/frame_axis.js").FrameAxis} FrameAxis
 * @typedef {import("../model/series.js").Curves} Curves
 * @typedef {import("../widgets/plot.js").Scale} Scale
 */

const TICKS_HEIGHT = 16;
const PLOT_GAP = 6;
/** Distance of the pointer within which it takes a point. */
const REACH = 8;
/** Least distance of frames whose poses are dots. */
const DOT_GAP = 6;
/** Opacity of interpolated stretches. */
const FAINT = 0.45;
const INTERPOLATED = SOURCES.indexOf("interpolated");
/** Minimum range of a plot, so that small changes do not look large. */
const MIN_SPAN = { deg: 20, cm: 10, px: 1 };
const UNITS = { deg: "degrees", cm: "cm", px: "px" };

/**
 * Draw all plots. Keyframes are diamonds on the curves, other poses dots where there is room; stretches that are interpolated
 * are faint, and chosen curves thick.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {FrameAxis} axis
 * @param {{curves: Curves, labels: string[], scales: Scale[], cells: import("../model/cells.js").Cells, chosen: number[]}} look
 *   labels: names of curves in the order of their colours; chosen: degrees of freedom
 * @param {number} height
 * @param {CSSStyleDeclaration} style
 */
export function drawCurves(context, axis, { curves, labels, scales, cells, chosen }, height, style) {
  const keys = markPositions(keyframesOf(cells), axis);
  const isPosed = (/** @type {number} */ frame) => cells.sources[frame] !== INTERPOLATED;
  curves.plots.forEach((plot, index) => {
    const scale = scales[index];
    // Labels at the edges would touch those of the next plot.
    drawValues(context, style, axis, scale, (y) => y >= scale.top + 5 && y <= scale.bottom - 4);
    drawKeyframes(context, keys, scale, style);
    drawWithin(context, { ...scale, left: axis.left, right: axis.right }, () => {
      context.lineJoin = "round";
      for (const { label, values, dof } of curves.series.filter((one) => one.plot === index)) {
        const y = (/** @type {number} */ value) => toY(scale, value);
        const color = labels.indexOf(label);
        context.strokeStyle = context.fillStyle = style.getPropertyValue(colorName(color));
        context.setLineDash(dashOf(color));
        context.lineWidth = dof !== null && chosen.includes(dof) ? 2.6 : 1.4;
        context.globalAlpha = FAINT;
        strokeCurve(context, values.map((value, frame) => ([-1, 0, 1].every((step) => isPosed(frame + step)) ? NaN : value)), axis, y);
        context.globalAlpha = 1;
        strokeCurve(context, values.map((value, frame) => (isPosed(frame) ? value : NaN)), axis, y);
        context.setLineDash([]);
        for (let frame = axis.first; axis.pitch >= DOT_GAP && frame <= axis.last; frame += 1) {
          if (isPosed(frame)) context.fillRect(axis.middle(frame) - 1.5, y(values[frame]) - 1.5, 3, 3);
        }
        for (const x of keys) drawDiamond(context, x, y(values[axis.frameAt(x)]), 4);
      }
    });
    drawTitle(context, axis, scale.top, `${plot.title}, ${UNITS[plot.unit]}`, style);
  });
  drawFrameNumbers(context, axis, height, style);
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {Float32Array} values
 * @param {FrameAxis} axis
 * @param {(value: number) => number} y
 */
function strokeCurve(context, values, axis, y) {
  const path = new Path2D();
  trace(path, values, axis, y);
  context.stroke(path);
}

/**
 * Scales of the plots, which lie below one another.
 *
 * @param {Curves} curves
 * @param {number} height
 */
export function scalesOf({ plots, series }, height) {
  const each = (height - TICKS_HEIGHT - PLOT_GAP * (plots.length - 1)) / plots.length;
  return plots.map(({ unit }, plot) => {
    const top = plot * (each + PLOT_GAP);
    return scaleOf(unit, series.filter((one) => one.plot === plot).map(({ values }) => values), top, top + each);
  });
}

/**
 * The curve whose value on a frame is nearest to a place, within the reach of the pointer; those chosen come first.
 *
 * @param {{curves: Curves, scales: Scale[], chosen: number[]}} look
 * @param {FrameAxis} axis
 * @param {{x: number, y: number}} at
 */
export function pointAt({ curves, scales, chosen }, axis, { x, y }) {
  const frame = axis.frameAt(x);
  let found = null;
  if (!axis.shows(frame) || Math.abs(axis.middle(frame) - x) > Math.max(REACH, axis.pitch / 4)) return null;
  for (const { dof, plot, values } of curves.series) {
    const at = toY(scales[plot], values[frame]);
    const distance = Math.abs(at - y) - (dof !== null && chosen.includes(dof) ? REACH / 2 : 0);
    if (dof !== null && distance <= (found?.distance ?? REACH)) found = { dof, frame, plot, y: at, distance };
  }
  return found;
}

/**
 * Draw rings around points.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {{x: number, y: number}[]} points
 * @param {string} color
 */
export function drawRings(context, points, color) {
  context.strokeStyle = color;
  context.lineWidth = 2;
  for (const { x, y } of points) context.stroke(circlePath(x, y, 6));
}

/**
 * Scale with a margin around the values. For costs it starts at 0.
 *
 * @param {import("../model/protocol.js").Plot["unit"]} unit
 * @param {Float32Array[]} curves
 * @param {number} top
 * @param {number} bottom
 * @returns {Scale}
 */
function scaleOf(unit, curves, top, bottom) {
  let { min, max } = extent(curves) ?? { min: 0, max: 0 };
  if (unit === "px") min = 0;
  const lacking = Math.max(0, MIN_SPAN[unit] - (max - min));
  if (unit !== "px") min -= lacking / 2;
  max += unit === "px" ? lacking : lacking / 2;
  const margin = 0.06 * (max - min);
  return { top, bottom, min: unit === "px" ? 0 : min - margin, max: max + margin };
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {FrameAxis} axis
 * @param {number} top
 * @param {string} text
 * @param {CSSStyleDeclaration} style
 */
function drawTitle(context, axis, top, text, style) {
  setText(context, "left", "top", "600 11px");
  const width = context.measureText(text).width;
  fillRect(context, style.getPropertyValue("--plot"), axis.left, top, width + 12, 16, 0.8);
  context.fillStyle = style.getPropertyValue("--muted");
  context.fillText(text, axis.left + 6, top + 3);
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {number[]} xs
 * @param {Scale} scale
 * @param {CSSStyleDeclaration} style
 */
function drawKeyframes(context, xs, { top, bottom }, style) {
  for (const x of xs) fillRect(context, style.getPropertyValue("--muted"), x - 0.5, top, 1, bottom - top, 0.35);
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {FrameAxis} axis
 * @param {number} height
 * @param {CSSStyleDeclaration} style
 */
function drawFrameNumbers(context, axis, height, style) {
  setText(context, "center", "bottom");
  context.fillStyle = style.getPropertyValue("--muted");
  for (const frame of axis.ticks(70)) {
    context.fillRect(axis.middle(frame) - 0.5, height - TICKS_HEIGHT, 1, 3);
    context.fillText(String(frame), Math.min(axis.middle(frame), axis.right - 14), height);
  }
  context.textAlign = "right";
  context.fillText("frame", axis.left - 6, height);
}
