/** Draw plots of curves below one another, on the axis of the timeline. Sizes are CSS pixels. */

import { drawWithin, setText } from "../widgets/canvas.js";
import { roundUp } from "../widgets/frame_axis.js";
import { extent, trace } from "../model/series.js";
import { colorName, dashOf } from "../widgets/series_lines.js";
import { drawDiamond } from "./cell_marks.js";
import { markPositions } from "./timeline_drawing.js";

/**
 * @typedef {import("../widgets/frame_axis.js").FrameAxis} FrameAxis
 * @typedef {import("../model/series.js").Curves} Curves
 * @typedef {{top: number, bottom: number, min: number, max: number}} Scale
 */

const TICKS_HEIGHT = 16;
const PLOT_GAP = 6;
const TICK_GAP = 22;
/** Minimum range of a plot, so that small changes do not look large. */
const MIN_SPAN = { deg: 20, cm: 10, px: 1 };
const UNITS = { deg: "degrees", cm: "cm", px: "px" };

/**
 * @param {CanvasRenderingContext2D} context
 * @param {FrameAxis} axis
 * @param {number} height
 * @param {Curves} curves
 * @param {string[]} labels all names of curves, in the order of their colours
 * @param {Set<string>} hidden names of the curves that are switched off
 * @param {Iterable<number>} keyframes
 * @param {CSSStyleDeclaration} style
 */
export function drawCurves(context, axis, height, curves, labels, hidden, keyframes, style) {
  const each = (height - TICKS_HEIGHT - PLOT_GAP * (curves.plots.length - 1)) / curves.plots.length;
  const keys = markPositions(keyframes, axis);
  curves.plots.forEach((plot, index) => {
    const series = curves.series.filter((one) => one.plot === index && !hidden.has(one.label));
    const top = index * (each + PLOT_GAP);
    const scale = scaleOf(plot.unit, series.map(({ values }) => values), top, top + each);
    drawFrame(context, axis, scale, style);
    drawKeyframes(context, keys, scale, style);
    drawWithin(context, { ...scale, left: axis.left, right: axis.right }, () => {
      context.lineWidth = 1.4;
      context.lineJoin = "round";
      for (const { label, values } of series) {
        const path = new Path2D();
        trace(path, values, axis, (value) => toY(scale, value));
        context.strokeStyle = style.getPropertyValue(colorName(labels.indexOf(label)));
        context.setLineDash(dashOf(labels.indexOf(label)));
        context.stroke(path);
      }
    });
    drawTitle(context, axis, top, `${plot.title}, ${UNITS[plot.unit]}`, style);
  });
  drawFrameNumbers(context, axis, height, style);
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
 * @param {Scale} scale
 * @param {number} value
 */
function toY({ top, bottom, min, max }, value) {
  return bottom - ((bottom - top) * (value - min)) / (max - min);
}

/**
 * Draw the background of a plot, grid lines at round values and their labels.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {FrameAxis} axis
 * @param {Scale} scale
 * @param {CSSStyleDeclaration} style
 */
function drawFrame(context, axis, scale, style) {
  context.fillStyle = style.getPropertyValue("--plot");
  context.fillRect(axis.left, scale.top, axis.right - axis.left, scale.bottom - scale.top);
  const step = roundUp(((scale.max - scale.min) * TICK_GAP) / (scale.bottom - scale.top));
  setText(context, "right", "middle");
  for (let value = Math.ceil(scale.min / step) * step; value <= scale.max; value += step) {
    const y = Math.round(toY(scale, value));
    context.fillStyle = style.getPropertyValue("--line");
    context.fillRect(axis.left, y, axis.right - axis.left, 1);
    // Labels at the edges would touch those of the next plot.
    if (y < scale.top + 5 || y > scale.bottom - 4) continue;
    context.fillStyle = style.getPropertyValue("--muted");
    context.fillText(String(Number(value.toPrecision(6))), axis.left - 6, y);
  }
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
  context.fillStyle = style.getPropertyValue("--plot");
  context.globalAlpha = 0.8;
  context.fillRect(axis.left, top, width + 12, 16);
  context.globalAlpha = 1;
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
  context.fillStyle = style.getPropertyValue("--muted");
  context.globalAlpha = 0.35;
  for (const x of xs) context.fillRect(x - 0.5, top, 1, bottom - top);
  context.globalAlpha = 1;
  for (const x of xs) drawDiamond(context, x, bottom - 4, 3.5);
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
