/**
 * Marks of the timeline: sources, statuses and keyframes. Besides its colour, each has its own shape. Sizes are CSS pixels.
 */

import { diamondPath, fillRect } from "../widgets/canvas.js";
import { make } from "../widgets/elements.js";

/** @typedef {{color: string, bands: [number, number][]}} SourceMark */

/**
 * Marks of the sources of a pose. The colour tells what made the pose: a hand, work on one frame, or a run over many. The
 * bands, from the top as fractions of the height, differ for every source.
 *
 * @type {Record<string, SourceMark>}
 */
export const SOURCE_MARKS = {
  manual: { color: "--source-hand", bands: [[0, 1]] },
  pinned: { color: "--source-hand", bands: [[0, 0.4], [0.6, 1]] },
  searched: { color: "--source-frame", bands: [[0.4, 1]] },
  fitted: { color: "--source-frame", bands: [[0.4, 0.6], [0.8, 1]] },
  tracked: { color: "--source-run", bands: [[0.2, 0.8]] },
  interpolated: { color: "--source-run", bands: [[0.4, 0.6]] },
  smoothed: { color: "--source-run", bands: [[0.2, 0.4], [0.6, 0.8]] },
  imported: { color: "--source-run", bands: [[0, 0.2], [0.8, 1]] },
}; // prettier-ignore

/** Statuses that are drawn, the worst last and on top. Besides its colour, each has its own height and pattern. */
export const STATUSES = /** @type {const} */ (["good", "doubtful", "lost"]);
export const STATUS_COLORS = { good: "--good", doubtful: "--warning", lost: "--bad" };
export const STATUS_HEIGHTS = { good: 3, doubtful: 7, lost: 12 };
/** Dotted line above poses of an earlier calibration. */
export const EARLIER_DASH = [2, 2];
/** Opacity of what covers dimmed frames: their marks stay recognizable. */
const DIMMED = 0.72;
/** Dark stripes on the colour of a person. */
export const DARK_INK = "rgb(0 0 0 / 72%)";

/**
 * Fill the bands of a source between two heights, to whole pixels.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {[number, number][]} bands
 * @param {number} x
 * @param {number} width
 * @param {{top: number, bottom: number}} lane
 */
export function fillBands(context, bands, x, width, { top, bottom }) {
  const height = bottom - top;
  for (const [from, to] of bands) {
    const [above, below] = [Math.round(from * height), Math.round(to * height)];
    context.fillRect(x, top + above, width, below - above);
  }
}

/**
 * Sample of a source for the legend.
 *
 * @param {string} source
 */
export function sourceSwatch(source) {
  const { color, bands } = SOURCE_MARKS[source];
  const stops = bands.flatMap(([from, to]) => [
    `transparent ${100 * from}%`, `var(${color}) ${100 * from}% ${100 * to}%`, `transparent ${100 * to}%`,
  ]); // prettier-ignore
  const mark = make("i", "source-mark");
  mark.style.backgroundImage = `linear-gradient(${stops.join(", ")})`;
  return mark;
}

/**
 * Sample of a status for the legend.
 *
 * @param {string} status
 */
export function statusSwatch(status) {
  return make("i", `status-mark is-${status}`);
}

/** Sample of a pose of an earlier calibration for the legend. */
export function earlierSwatch() {
  return make("i", "earlier-mark");
}

/** Sample of a keyframe for the legend. */
export function diamondSwatch() {
  return make("i", "keyframe-mark");
}

/** Colours of the states of tasks. Besides its colour, each has its own shape. */
export const TASK_COLORS = { draft: "--muted", annotated: "--accent", verified: "--good", rejected: "--bad" };

/**
 * Draw the mark of a task: a frame for a draft, half filled once annotated, filled once verified, a cross if rejected.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {import("../model/protocol.js").TaskState} state
 * @param {number} x middle
 * @param {{top: number, bottom: number}} lane
 * @param {CSSStyleDeclaration} style
 */
export function drawTask(context, state, x, { top, bottom }, style) {
  const size = bottom - top;
  const left = Math.round(x - size / 2);
  fillRect(context, style.getPropertyValue("--chrome"), left, top, size, size);
  context.fillStyle = context.strokeStyle = style.getPropertyValue(TASK_COLORS[state]);
  context.lineWidth = state === "rejected" ? 2 : 1;
  if (state === "rejected") {
    context.beginPath();
    context.moveTo(left + 1, top + 1);
    context.lineTo(left + size - 1, bottom - 1);
    context.moveTo(left + size - 1, top + 1);
    context.lineTo(left + 1, bottom - 1);
    context.stroke();
    return;
  }
  context.strokeRect(left + 0.5, top + 0.5, size - 1, size - 1);
  if (state === "annotated") context.fillRect(left, top + size / 2, size, size / 2);
  if (state === "verified") context.fillRect(left, top, size, size);
}

/**
 * Sample of a task for the legend.
 *
 * @param {string} state
 */
export function taskSwatch(state) {
  return make("i", `task-mark is-${state}`);
}

/**
 * Make a pattern of diagonal stripes in one direction, or in both.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {string} color
 * @param {string} stripes
 * @param {boolean} isCrossed
 */
export function hatch(context, color, stripes, isCrossed) {
  const size = 6;
  const tile = make("canvas", { width: size, height: size });
  const ink = /** @type {CanvasRenderingContext2D} */ (tile.getContext("2d"));
  ink.fillStyle = color;
  ink.fillRect(0, 0, size, size);
  ink.strokeStyle = stripes;
  ink.lineWidth = isCrossed ? 1.2 : 2;
  for (const way of isCrossed ? [1, -1] : [1]) {
    for (const shift of [-size, 0, size]) {
      ink.beginPath();
      ink.moveTo(shift, way > 0 ? size : 0);
      ink.lineTo(shift + size, way > 0 ? 0 : size);
      ink.stroke();
    }
  }
  return context.createPattern(tile, "repeat") ?? color;
}

/**
 * Draw the diamond of a keyframe.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {number} x
 * @param {number} y
 * @param {number} radius
 * @param {string} fill
 */
export function drawDiamond(context, x, y, radius, fill = "#fff") {
  drawMark(context, diamondPath(x, y, radius), fill, 1);
}

/**
 * Draw a mark with a dark border.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {Path2D} mark
 * @param {string} fillStyle
 * @param {number} lineWidth
 */
export function drawMark(context, mark, fillStyle, lineWidth) {
  Object.assign(context, { fillStyle, strokeStyle: DARK_INK, lineWidth });
  context.fill(mark);
  context.stroke(mark);
}

/**
 * Draw runs of equal neighbouring frames as rectangles. Their number is bounded by the number of changes, and by that of
 * pixels.
 *
 * @param {import("../widgets/frame_axis.js").FrameAxis} axis
 * @param {(frame: number) => number} look value of a frame; below 0 for nothing to draw
 * @param {number} gap between frames, CSS pixels
 * @param {(look: number, x: number, width: number) => void} draw
 */
export function eachRun(axis, look, gap, draw) {
  for (let frame = axis.first; frame <= axis.last; ) {
    const found = look(frame);
    let next = frame + 1;
    if (gap === 0) while (next <= axis.last && look(next) === found) next += 1;
    if (found >= 0) draw(found, axis.start(frame), Math.max(1, (next - frame) * axis.pitch - gap));
    frame = next;
  }
}

/** @param {import("../widgets/frame_axis.js").FrameAxis} axis */
export function gapOf(axis) {
  return axis.pitch >= 5 ? 1 : 0;
}

/**
 * Dim frames that a filter does not let through.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {import("../widgets/frame_axis.js").FrameAxis} axis
 * @param {(frame: number) => boolean} isKept
 * @param {CSSStyleDeclaration} style
 * @param {{top: number, bottom: number}} lane
 */
export function drawDimmed(context, axis, isKept, style, { top, bottom }) {
  const color = style.getPropertyValue("--chrome");
  eachRun(axis, (frame) => (isKept(frame) ? -1 : 0), 0, (_, x, width) =>
    fillRect(context, color, x, top - 3, width, bottom - top + 6, DIMMED),
  );
}

/**
 * Draw how far another copy differs, as bars that are full at twice the tolerance, with a line at the tolerance. Decided
 * differences are faint.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {import("../widgets/frame_axis.js").FrameAxis} axis
 * @param {import("../model/protocol.js").OtherCopyMessage} copy
 * @param {CSSStyleDeclaration} style
 * @param {{top: number, bottom: number}} band
 */
export function drawCopy(context, axis, { people, tolerance_mm }, style, { top, bottom }) {
  const of = (/** @type {string} */ name) => style.getPropertyValue(name);
  fillRect(context, of("--track"), axis.left, top, axis.right - axis.left, bottom - top);
  const height = bottom - top;
  for (const { frame, distance_mm, decided } of people.flat().sort((a, b) => a.distance_mm - b.distance_mm)) {
    if (!axis.shows(frame)) continue;
    const share = tolerance_mm > 0 ? Math.min(1, distance_mm / (2 * tolerance_mm)) : Number(distance_mm > 0);
    const tall = Math.max(2, Math.round(share * height));
    const width = Math.max(3, axis.pitch - gapOf(axis));
    const color = decided ? "--faint" : distance_mm > tolerance_mm ? "--warning" : "--good";
    fillRect(context, of(color), axis.middle(frame) - width / 2, bottom - tall, width, tall);
  }
  fillRect(context, of("--text"), axis.left, Math.round((top + bottom) / 2), axis.right - axis.left, 1);
}
