/** Draws the timeline: cost curve, strip of statuses, cells by source, keyframes, marked range. Sizes are CSS pixels. */

import { trace } from "./series.js";

/**
 * @typedef {import("./frame_axis.js").FrameAxis} FrameAxis
 * @typedef {Map<number, import("./protocol.js").Cell>} Cells
 */

export const HEIGHT = 70;
const COST = { top: 6, bottom: 30 };
const STATUS = { top: 34, bottom: 46 };
const KEYFRAME_GAP = 5;
export const CELL = { top: 50, bottom: 62 };

/** Statuses that are drawn, the worst last and on top: each has a height of its own besides its colour. */
export const STATUSES = /** @type {const} */ (["good", "doubtful", "lost"]);
const STATUS_HEIGHTS = { good: 3, doubtful: 7, lost: 12 };

/**
 * @param {CanvasRenderingContext2D} context
 * @param {FrameAxis} axis
 * @param {CSSStyleDeclaration} style
 */
export function drawLabels(context, axis, style) {
  context.font = "10.5px system-ui, sans-serif";
  context.textAlign = "right";
  context.textBaseline = "middle";
  context.fillStyle = style.getPropertyValue("--muted");
  for (const [text, { top, bottom }] of /** @type {const} */ ([["cost", COST], ["status", STATUS], ["pose", CELL]])) {
    context.fillText(text, axis.left - 8, (top + bottom) / 2);
  }
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {FrameAxis} axis
 * @param {Cells} cells
 * @param {CSSStyleDeclaration} style
 */
export function drawSources(context, axis, cells, style) {
  const height = CELL.bottom - CELL.top;
  context.fillStyle = style.getPropertyValue("--track");
  context.fillRect(axis.left, CELL.top, axis.right - axis.left, height);
  const colors = new Map();
  const gap = axis.pitch >= 5 ? 1 : 0;
  /** @type {Map<number, string>} the source that each pixel shows, where frames share one */
  const drawn = new Map();
  for (const [frame, { source }] of cells) {
    const x = axis.start(frame);
    // The next frame of the same colour on the same pixel changes nothing.
    if (axis.pitch < 1 && drawn.get(Math.floor(x)) === source) continue;
    drawn.set(Math.floor(x), source);
    if (!colors.has(source)) {
      colors.set(source, style.getPropertyValue(`--source-${source}`) || style.getPropertyValue("--muted"));
    }
    context.fillStyle = colors.get(source);
    context.fillRect(x, CELL.top, Math.max(1, axis.pitch - gap), height);
  }
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {FrameAxis} axis
 * @param {Iterable<number>} keyframes
 */
export function drawKeyframes(context, axis, keyframes) {
  const y = (CELL.top + CELL.bottom) / 2;
  for (const x of placesOf(keyframes, axis)) drawDiamond(context, x, y, 4);
}

/**
 * Where keyframes are marked: of those that would cover each other only one.
 *
 * @param {Iterable<number>} frames
 * @param {FrameAxis} axis
 */
export function placesOf(frames, axis) {
  const places = new Map();
  for (const frame of frames) places.set(Math.floor(axis.middle(frame) / KEYFRAME_GAP), axis.middle(frame));
  return [...places.values()];
}

/** @param {Cells} cells */
export function keyframesOf(cells) {
  return [...cells].filter(([, { keyframe }]) => keyframe).map(([frame]) => frame);
}

/**
 * Bars that stand the higher the worse a frame is; the worst of the frames that share a pixel is the one seen.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {FrameAxis} axis
 * @param {Cells} cells
 * @param {CSSStyleDeclaration} style
 */
export function drawStatuses(context, axis, cells, style) {
  const columns = STATUSES.map(() => new Set());
  const gap = axis.pitch >= 5 ? 1 : 0;
  for (const [frame, { status }] of cells) {
    const rank = STATUSES.indexOf(/** @type {typeof STATUSES[number]} */ (status));
    if (rank >= 0) columns[rank].add(axis.pitch < 1 ? Math.floor(axis.start(frame)) : axis.start(frame));
  }
  columns.forEach((xs, rank) => {
    const status = STATUSES[rank];
    // What is seldom must still be seen: a single bad frame among thousands is two pixels wide.
    const width = Math.max(status === "good" ? 1 : 2, axis.pitch - gap);
    context.fillStyle = style.getPropertyValue(`--status-${status}`);
    const height = STATUS_HEIGHTS[status];
    for (const x of xs) context.fillRect(x, STATUS.bottom - height, width, height);
  });
}

/**
 * The cost curve, from 0 at the bottom to the 98th percentile at the top: one lost frame must not flatten the rest.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {FrameAxis} axis
 * @param {Cells} cells
 * @param {CSSStyleDeclaration} style
 */
export function drawCosts(context, axis, cells, style) {
  const values = new Float32Array(axis.frames).fill(NaN);
  for (const [frame, { cost_px }] of cells) if (cost_px !== null) values[frame] = cost_px;
  const ordered = values.filter((value) => value === value).sort();
  if (ordered.length === 0) return;
  const most = Math.max(1e-6, ordered[Math.floor(0.98 * (ordered.length - 1))]);
  const path = new Path2D();
  trace(path, values, axis, (value) => COST.bottom - (COST.bottom - COST.top) * Math.min(1, value / most));
  context.strokeStyle = style.getPropertyValue("--text");
  context.globalAlpha = 0.75;
  context.lineWidth = 1.25;
  context.lineJoin = "round";
  context.stroke(path);
  context.globalAlpha = 1;
}

/**
 * A bracket over the frames that the user has marked.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {FrameAxis} axis
 * @param {{first: number, last: number}} range
 * @param {CSSStyleDeclaration} style
 */
export function drawRange(context, axis, { first, last }, style) {
  const [left, right] = [axis.start(first), axis.start(last + 1)];
  context.fillStyle = style.getPropertyValue("--accent");
  context.globalAlpha = 0.14;
  context.fillRect(left, 0, right - left, HEIGHT);
  context.globalAlpha = 1;
  context.fillRect(left, 0, Math.max(2, right - left), 2);
  context.fillRect(left, 0, 2, 7);
  context.fillRect(Math.max(left, right - 2), 0, 2, 7);
}

/**
 * The mark of a keyframe.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {number} x
 * @param {number} y
 * @param {number} radius
 */
export function drawDiamond(context, x, y, radius) {
  context.beginPath();
  context.moveTo(x, y - radius);
  context.lineTo(x + radius, y);
  context.lineTo(x, y + radius);
  context.lineTo(x - radius, y);
  context.closePath();
  context.fillStyle = "#fff";
  context.strokeStyle = "rgba(0, 0, 0, 0.7)";
  context.lineWidth = 1;
  context.fill();
  context.stroke();
}
