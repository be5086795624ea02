/**
 * Draw the timeline: costs, statuses, cells by source with keyframes, review marks, the marked range and the overview. Sizes
 * are CSS pixels.
 */

import { circlePath, drawWithin, fillRect, setText } from "../widgets/canvas.js";
import { NO_POSE, REVIEWED, SOURCES, STATUSES as ALL, keyframesOf } from "../model/cells.js";
import { TASK_STATES } from "../model/tasks.js";
import { trace } from "../model/series.js";
import { shortened } from "../widgets/text.js";
import { DARK_INK, EARLIER_DASH, SOURCE_MARKS, STATUSES, STATUS_COLORS, STATUS_HEIGHTS, drawDiamond, drawMark, drawTask, eachRun, fillBands, gapOf, hatch } from "./cell_marks.js";

/**
 * @typedef {import("../widgets/frame_axis.js").FrameAxis} FrameAxis
 * @typedef {import("../model/cells.js").Cells} Cells
 */

const COST = { top: 4, bottom: 24 };
const STATUS = { top: 28, bottom: 40 };
const KEYFRAME_GAP = 5;
const CELLS_TOP = 44;
/** Height of the cells of a single person, and of each of several people; gap between lanes. */
const [CELL_HEIGHT, LANE_HEIGHT, LANE_GAP] = [12, 15, 3];
/** Height of the lane of differences from another copy. */
const COPY_HEIGHT = 12;
/** Height of the strip of sources below the colour of a person, and the gap between them. */
const [SOURCE_STRIP, STRIP_GAP] = [5, 1];
/** Height of the lane of tasks. */
const TASK_HEIGHT = 8;
/** Width of a run from which its status is drawn as a pattern; a narrower one would show a random part of it. */
const PATTERN_FROM = 4;

/** @typedef {{top: number, bottom: number}} Band */

/**
 * Vertical layout. Each person has a lane of cells.
 *
 * @param {number} people
 * @param {boolean} hasTasks whether there is a lane of tasks
 * @param {boolean} hasCopy whether another copy is compared, which has a lane of its own
 * @returns {{cells: Band, lanes: Band[], review: Band, tasks: Band, copy: Band | null, overview: Band, height: number}}
 */
export function layout(people, hasTasks = false, hasCopy = false) {
  const several = people > 1;
  const height = several ? LANE_HEIGHT : CELL_HEIGHT;
  const lanes = Array.from({ length: Math.max(1, people) }, (_, lane) => {
    const top = CELLS_TOP + lane * (height + LANE_GAP);
    return { top, bottom: top + height };
  });
  const { bottom } = lanes[lanes.length - 1];
  const tasks = { top: bottom + 7, bottom: bottom + 7 + (hasTasks ? TASK_HEIGHT : 0) };
  const end = hasTasks ? tasks.bottom : bottom;
  const copy = hasCopy ? { top: end + 8, bottom: end + 8 + COPY_HEIGHT } : null;
  const top = (copy?.bottom ?? end) + (hasTasks && !copy ? 5 : 8);
  const overview = { top, bottom: top + 6 };
  const cells = { top: CELLS_TOP, bottom };
  const review = { top: bottom + 2, bottom: bottom + 4 };
  return { cells, lanes, review, tasks, copy, overview, height: overview.bottom + 2 };
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {FrameAxis} axis
 * @param {CSSStyleDeclaration} style
 * @param {Band[]} lanes one per person
 * @param {import("../model/protocol.js").PersonInfo[]} people
 * @param {Band | null} copy lane of the differences from another copy
 */
export function drawLabels(context, axis, style, lanes, people, copy) {
  setText(context, "right", "middle");
  context.fillStyle = style.getPropertyValue("--muted");
  /** @type {[string, Band][]} */
  const rows = [["cost", COST], ["status", STATUS]]; // prettier-ignore
  if (people.length < 2) rows.push(["pose", lanes[0]]);
  if (copy) rows.push(["differs", copy]);
  for (const [text, { top, bottom }] of rows) context.fillText(text, axis.left - 8, (top + bottom) / 2);
  if (people.length > 1) people.forEach((person, lane) => drawName(context, axis, style, person, lanes[lane]));
}

/**
 * Draw the name of a lane, shortened to fit, and a strip in the person's colour.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {FrameAxis} axis
 * @param {CSSStyleDeclaration} style
 * @param {import("../model/protocol.js").PersonInfo} person
 * @param {Band} lane
 */
function drawName(context, axis, style, { name, color }, { top, bottom }) {
  const room = axis.left - 12;
  const text = shortened(name, (one) => context.measureText(one).width <= room);
  context.fillText(text, axis.left - 9, (top + bottom) / 2);
  const { fillStyle } = context;
  fillRect(context, style.getPropertyValue("--edge"), axis.left - 7, top - 1, 6, bottom - top + 2);
  fillRect(context, color, axis.left - 6, top, 4, bottom - top);
  context.fillStyle = fillStyle;
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {FrameAxis} axis
 * @param {Cells} cells
 * @param {CSSStyleDeclaration} style
 * @param {Band} lane
 */
export function drawSources(context, axis, cells, style, { top, bottom }) {
  fillRect(context, style.getPropertyValue("--track"), axis.left, top, axis.right - axis.left, bottom - top);
  const marks = SOURCES.map((source) => SOURCE_MARKS[source]);
  const colors = marks.map(({ color }) => style.getPropertyValue(color));
  const { sources } = cells;
  eachRun(axis, (frame) => (sources[frame] === NO_POSE ? -1 : sources[frame]), gapOf(axis), (source, x, width) => {
    context.fillStyle = colors[source];
    fillBands(context, marks[source].bands, x, width, { top, bottom });
  });
}

/**
 * Draw the lane of one of several people: the person's colour with the pattern of the status, and a strip of the source
 * below. Doubtful is striped, lost is cross-hatched on its own colour, everything else is plain.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {FrameAxis} axis
 * @param {Cells} cells
 * @param {CSSStyleDeclaration} style
 * @param {Band} lane
 * @param {string} color of the person
 */
export function drawPerson(context, axis, cells, style, { top, bottom }, color) {
  drawSources(context, axis, cells, style, { top: bottom - SOURCE_STRIP, bottom });
  const split = bottom - SOURCE_STRIP - STRIP_GAP;
  const { sources, statuses } = cells;
  const of = (/** @type {string} */ name) => style.getPropertyValue(name);
  const lost = of("--bad");
  const fills = { good: color, doubtful: hatch(context, color, DARK_INK, false), lost: hatch(context, lost, of("--hatch"), true) };
  const narrow = { good: color, doubtful: of("--warning"), lost };
  fillRect(context, of("--track"), axis.left, top, axis.right - axis.left, split - top);
  // The worst last: where frames share a pixel, it stays visible.
  for (const kind of STATUSES) {
    const is = (/** @type {number} */ frame) =>
      sources[frame] !== NO_POSE && (STATUSES.find((one) => one === ALL[statuses[frame]]) ?? "good") === kind;
    const min = kind === "good" ? 1 : 2;
    eachRun(axis, (frame) => (is(frame) ? 0 : -1), gapOf(axis), (_, x, width) => {
      const wide = Math.max(min, width);
      fillRect(context, (width < PATTERN_FROM ? narrow : fills)[kind], x, top, wide, split - top);
      // Colours of people are bright for footage: on a bright page their areas have dark edges.
      for (const y of [top, split - 1]) fillRect(context, of("--edge"), x, y, wide, 1);
    });
  }
}

/**
 * Draw a dotted line above cells with poses of an earlier calibration.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {FrameAxis} axis
 * @param {Set<number>} frames
 * @param {CSSStyleDeclaration} style
 * @param {Band} lane
 */
export function drawEarlier(context, axis, frames, style, { top }) {
  context.save();
  context.strokeStyle = style.getPropertyValue("--text");
  context.setLineDash(EARLIER_DASH);
  context.lineWidth = 1;
  context.beginPath();
  eachRun(axis, (frame) => (frames.has(frame) ? 0 : -1), 0, (_, x, width) => {
    context.moveTo(x, top - 1.5);
    context.lineTo(x + width, top - 1.5);
  });
  context.stroke();
  context.restore();
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {FrameAxis} axis
 * @param {Iterable<number>} keyframes
 * @param {Band} lane
 */
export function drawKeyframes(context, axis, keyframes, { top, bottom }) {
  const y = (top + bottom) / 2;
  for (const x of markPositions(keyframes, axis)) drawDiamond(context, x, y, 4);
}

/**
 * Draw a larger diamond with an exclamation mark at keyframes in doubt.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {FrameAxis} axis
 * @param {Iterable<number>} frames
 * @param {CSSStyleDeclaration} style
 * @param {Band} lane
 */
export function drawDoubtedKeyframes(context, axis, frames, style, { top, bottom }) {
  const y = (top + bottom) / 2;
  for (const x of markPositions(frames, axis)) {
    drawDiamond(context, x, y, 7, style.getPropertyValue("--warning"));
    fillRect(context, style.getPropertyValue("--chrome"), x - 0.75, y - 3.5, 1.5, 4.5);
    context.fillRect(x - 0.75, y + 2, 1.5, 1.5);
  }
}

/**
 * Draw two rings at ambiguous frames.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {FrameAxis} axis
 * @param {Iterable<number>} frames
 * @param {Band} lane
 */
export function drawAmbiguous(context, axis, frames, { top, bottom }) {
  const middle = (top + bottom) / 2;
  for (const x of markPositions(frames, axis)) {
    for (const y of [middle - 2, middle + 2]) drawMark(context, circlePath(x, y, 2), "#fff", 1.25);
  }
}

/**
 * Visible positions of marks, thinned so that they do not overlap.
 *
 * @param {Iterable<number>} frames
 * @param {FrameAxis} axis
 */
export function markPositions(frames, axis) {
  const places = new Map();
  for (const frame of frames) {
    if (axis.shows(frame)) places.set(Math.floor(axis.middle(frame) / KEYFRAME_GAP), axis.middle(frame));
  }
  return [...places.values()];
}

/**
 * Draw a line below frames that are reviewed or keyframes.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {FrameAxis} axis
 * @param {Cells} cells
 * @param {CSSStyleDeclaration} style
 * @param {Band} band
 */
export function drawReviewed(context, axis, cells, style, { top, bottom }) {
  const [{ marks }, color] = [cells, style.getPropertyValue("--good")];
  eachRun(axis, (frame) => (marks[frame] & REVIEWED ? 0 : -1), 0, (_, x, width) => fillRect(context, color, x, top, width, bottom - top));
}

/**
 * Draw a mark at each planned frame, and the name of the lane.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {FrameAxis} axis
 * @param {Map<number, import("../model/protocol.js").TaskState>} tasks state by frame
 * @param {CSSStyleDeclaration} style
 * @param {Band} lane
 */
export function drawTasks(context, axis, tasks, style, { top, bottom }) {
  setText(context, "right", "middle");
  context.fillStyle = style.getPropertyValue("--muted");
  context.fillText("tasks", axis.left - 8, (top + bottom) / 2);
  // The states that need work last: where frames share a pixel, they stay visible.
  const inOrder = [...tasks].sort(([, a], [, b]) => TASK_STATES.indexOf(b) - TASK_STATES.indexOf(a));
  for (const [frame, state] of inOrder) {
    if (axis.shows(frame)) drawTask(context, state, axis.middle(frame), { top, bottom }, style);
  }
}

/**
 * Draw statuses as bars, higher for worse ones. The worst of the frames that share a pixel is visible.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {FrameAxis} axis
 * @param {Cells} cells
 * @param {CSSStyleDeclaration} style
 */
export function drawStatuses(context, axis, cells, style) {
  const { statuses } = cells;
  for (const status of STATUSES) {
    const index = ALL.indexOf(status);
    const height = STATUS_HEIGHTS[status];
    // Rare bad frames must remain visible, so bars are at least two pixels wide.
    const min = status === "good" ? 1 : 2;
    const color = style.getPropertyValue(STATUS_COLORS[status]);
    const fill = status === "good" ? color : hatch(context, color, style.getPropertyValue("--hatch"), status === "lost");
    eachRun(axis, (frame) => (statuses[frame] === index ? index : -1), gapOf(axis), (_, x, width) => {
      fillRect(context, width < PATTERN_FROM ? color : fill, x, STATUS.bottom - height, Math.max(min, width), height);
    });
  }
}

/**
 * Draw the cost curve from 0 to the 98th percentile, so that single lost frames do not flatten the rest.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {FrameAxis} axis
 * @param {Cells} cells
 * @param {CSSStyleDeclaration} style
 */
export function drawCosts(context, axis, cells, style) {
  const ordered = cells.costs.filter((value) => value === value).sort();
  if (ordered.length === 0) return;
  const max = Math.max(1e-6, ordered[Math.floor(0.98 * (ordered.length - 1))]);
  const path = new Path2D();
  trace(path, cells.costs, axis, (value) => COST.bottom - (COST.bottom - COST.top) * Math.min(1, value / max));
  drawWithin(context, { left: axis.left, top: 0, right: axis.right, bottom: STATUS.top }, () => {
    Object.assign(context, { strokeStyle: style.getPropertyValue("--text"), globalAlpha: 0.75, lineWidth: 1.25, lineJoin: "round" });
    context.stroke(path);
  });
}

/**
 * Draw the overview of the recording: poses, review marks, keyframes, doubtful and lost frames.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {FrameAxis} whole axis of all frames
 * @param {Cells} cells
 * @param {CSSStyleDeclaration} style
 * @param {Band} overview
 */
export function drawOverview(context, whole, cells, style, overview) {
  const height = overview.bottom - overview.top;
  fillRect(context, style.getPropertyValue("--track"), whole.left, overview.top, whole.right - whole.left, height);
  const { statuses, marks, sources } = cells;
  /** @type {[(frame: number) => boolean, string, number][]} condition, colour, fraction of the height */
  const layers = [
    [(frame) => sources[frame] !== NO_POSE, "--faint", 1 / 3],
    [(frame) => (marks[frame] & REVIEWED) !== 0, "--good", 1 / 2],
    [(frame) => STATUSES[statuses[frame] - 1] === "doubtful", "--warning", 2 / 3],
    [(frame) => STATUSES[statuses[frame] - 1] === "lost", "--bad", 1],
  ];
  for (const [is, color, share] of layers) {
    eachRun(whole, (frame) => (is(frame) ? 0 : -1), 0, (_, x, width) => {
      fillRect(context, style.getPropertyValue(color), x, overview.bottom - share * height, width, share * height);
    });
  }
  context.fillStyle = style.getPropertyValue("--text");
  for (const x of markPositions(keyframesOf(cells), whole)) context.fillRect(x - 0.5, overview.top, 1, 3);
}

/**
 * Draw the visible part and the current frame in the overview.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {FrameAxis} whole axis of all frames
 * @param {import("../widgets/frame_axis.js").Span | null} visible
 * @param {number} target
 * @param {CSSStyleDeclaration} style
 * @param {Band} overview
 */
export function drawWindow(context, whole, visible, target, style, overview) {
  fillRect(context, style.getPropertyValue("--text"), whole.middle(target) - 0.5, overview.top - 1, 1, overview.bottom - overview.top + 2);
  if (!visible) return;
  const [left, right] = [whole.start(visible.start), whole.start(visible.end)];
  /** @type {[number, number, number, number]} */
  const box = [left, overview.top - 2, Math.max(6, right - left), overview.bottom - overview.top + 4];
  fillRect(context, style.getPropertyValue("--accent"), ...box, 0.25);
  Object.assign(context, { strokeStyle: style.getPropertyValue("--accent"), lineWidth: 1.5 });
  context.strokeRect(...box);
}

/**
 * Draw a bracket over the marked range.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {FrameAxis} axis
 * @param {{first: number, last: number}} range
 * @param {CSSStyleDeclaration} style
 * @param {number} bottom lower end of the bracket
 */
export function drawRange(context, axis, { first, last }, style, bottom) {
  const left = Math.max(axis.left, axis.start(first));
  const right = Math.min(axis.right, axis.start(last + 1));
  if (right <= axis.left || left >= axis.right) return;
  fillRect(context, style.getPropertyValue("--accent"), left, 0, right - left, bottom, 0.14);
  context.fillRect(left, 0, Math.max(2, right - left), 2);
  if (axis.shows(first)) context.fillRect(left, 0, 2, 7);
  if (axis.shows(last)) context.fillRect(Math.max(left, right - 2), 0, 2, 7);
}
