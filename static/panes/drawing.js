/** Draw a pane: pictures, and vectors over them. All sizes on the screen are CSS pixels. */

import { addLine, circlePath, diamondPath, fillRect, setText } from "../widgets/canvas.js";
import { OFF_DASH, imageColor } from "../widgets/image_colors.js";

/**
 * @typedef {import("../model/protocol.js").Overlay} Overlay
 * @typedef {import("../model/protocol.js").Handle} Handle
 * @typedef {import("./pane_view.js").PaneView} PaneView
 * @typedef {{handle: Handle, x: number, y: number}} PlacedHandle
 */

const PIXELS_VISIBLE_FROM = 4;
const BEHIND_IMAGES = "#000";
const JOINT_RADIUS = 3.5;
const TORSO_HALF_SIDE = 5.5;
const TORSO = "torso";
/** Half diagonal of the diamonds of right joints. */
const DIAMOND_RADIUS = 4.75;
/** Distance of a label below its joint, where it fits on neither side, CSS pixels. */
const BELOW_JOINT_PX = 24;
const LABEL_LINE_PX = 16;
const HELD_RADIUS = 8.5;
/** Height of the labels in the upper corners of a pane. */
const CORNERS_PX = 44;
/** Dashes of right limbs: sides differ in line, people in colour. */
const RIGHT_DASH = [9, 4];
/** Border of joints behind a dimmed person. */
const BEHIND_DASH = [2, 2.5];
/** Opacity of dimmed people. */
const DIMMED = 0.3;
/** Across a blurred head, as in exports (tracker/interchange/exports/faces.py). */
const GRAINS = 4;

/**
 * Line style and layer of each kind of path. A layer of null is always drawn.
 *
 * @typedef {{width: number, dash: number[], layer: import("../model/protocol.js").Layer | null, hasOutline: boolean,
 *   ofPerson?: boolean, switch?: import("../model/protocol.js").Layer}} LineStyle ofPerson: whether they are dimmed with
 *   their person; switch: a layer that hides them, too, and has their opacity
 * @type {Record<import("../model/protocol.js").Path["kind"], LineStyle>}
 */
export const LINE_STYLES = {
  model: { width: 1.75, dash: [], layer: "contours", hasOutline: true, ofPerson: true },
  hidden: { width: 1.25, dash: [4, 4], layer: "hidden", hasOutline: true, ofPerson: true },
  facing: { width: 2.25, dash: [], layer: "contours", hasOutline: true, ofPerson: true },
  facing_away: { width: 2.25, dash: [3, 4], layer: "contours", hasOutline: true, ofPerson: true },
  candidate: { width: 1.25, dash: [], layer: "contours", hasOutline: true, ofPerson: true },
  compared: { width: 1.5, dash: [6, 4], layer: "contours", hasOutline: true, ofPerson: true },
  preview: { width: 1.75, dash: [2, 4], layer: "contours", hasOutline: true, ofPerson: true },
  result: { width: 2, dash: [0.5, 4.5], layer: "contours", hasOutline: true, ofPerson: true },
  alternative: { width: 1.5, dash: [9, 4, 2, 4], layer: "contours", switch: "alternatives", hasOutline: true, ofPerson: true },
  new_sizes: { width: 1.5, dash: [9, 4, 2, 4, 2, 4], layer: "contours", hasOutline: true, ofPerson: true },
  other_copy: { width: 1.5, dash: [9, 4, 2, 4, 2, 4], layer: "contours", switch: "alternatives", hasOutline: true, ofPerson: true },
  former: { width: 1.5, dash: [9, 4, 2, 4], layer: "contours", hasOutline: true, ofPerson: true },
  error: { width: 1.25, dash: [], layer: "errors", hasOutline: true, ofPerson: true },
  residual: { width: 1, dash: [], layer: null, hasOutline: true },
  part_edge: { width: 1, dash: [], layer: "part_edges", hasOutline: true },
  epipolar: { width: 1.25, dash: [6, 4], layer: "epipolar", hasOutline: true },
  // Outlines would merge thousands of short lines into one area.
  accepted: { width: 1.5, dash: [], layer: "accepted", hasOutline: false },
  floor: { width: 1.25, dash: [], layer: null, hasOutline: true },
  floor_sight: { width: 1.5, dash: [5, 4], layer: null, hasOutline: true },
  rejected: { width: 1, dash: [], layer: "rejected", hasOutline: false },
  imported: { width: 1, dash: [], layer: "imported", hasOutline: true },
  imported_off: { width: 2, dash: [], layer: "imported", hasOutline: true },
};

/**
 * Draw a dark background, so that translucent layers look the same in both colour schemes.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {PaneView} view
 */
export function drawBackground(context, view) {
  const { x, y, width, height } = view.place;
  fillRect(context, BEHIND_IMAGES, x, y, width, height);
}

/**
 * Draw a picture of any size over the area of the whole image.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {PaneView} view
 * @param {CanvasImageSource & {width: number, height: number}} picture
 * @param {number} opacity
 */
export function drawPicture(context, view, picture, opacity) {
  const { x, y, width, height } = view.place;
  // Zoomed in far, show single pixels.
  context.imageSmoothingEnabled = width / picture.width < PIXELS_VISIBLE_FROM;
  context.imageSmoothingQuality = "medium";
  context.globalAlpha = opacity;
  context.drawImage(picture, x, y, width, height);
  context.globalAlpha = 1;
}

/**
 * Reduce circles of a picture to a few grains; without circles, the whole picture.
 *
 * @param {CanvasRenderingContext2D} context of a canvas over the picture
 * @param {HTMLCanvasElement} picture
 * @param {{x: number, y: number, radius: number}[] | null} circles
 */
export function drawGrains(context, picture, circles) {
  const { width, height } = context.canvas.getBoundingClientRect();
  const ratio = picture.width / width;
  const grains = new OffscreenCanvas(GRAINS, GRAINS);
  const coarse = /** @type {OffscreenCanvasRenderingContext2D} */ (grains.getContext("2d"));
  coarse.imageSmoothingQuality = "high";
  for (const { x, y, radius } of circles ?? [{ x: width / 2, y: height / 2, radius: Math.hypot(width, height) / 2 }]) {
    const [left, top, side] = [x - radius, y - radius, 2 * radius];
    coarse.drawImage(picture, left * ratio, top * ratio, side * ratio, side * ratio, 0, 0, GRAINS, GRAINS);
    context.save();
    context.clip(circlePath(x, y, radius));
    context.drawImage(grains, left, top, side, side);
    context.restore();
  }
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {PaneView} view
 * @param {Overlay} overlay
 * @param {number} camera
 * @param {import("../model/layers.js").LayerChoice} layers
 * @param {(person: number) => boolean} isDimmed whether a person is dimmed
 */
export function drawPaths(context, view, overlay, camera, layers, isDimmed) {
  for (const path of overlay.paths) {
    if (path.camera !== camera || path.count === 0) continue;
    const style = LINE_STYLES[path.kind];
    if ([style.layer, style.switch].some((layer) => layer && !layers.shown[layer])) continue;
    const line = tracePath(view, overlay.segments, path.first, path.count);
    const isFaint = style.ofPerson && isDimmed(path.person);
    const layer = style.switch ?? style.layer;
    context.globalAlpha = (layer ? layers.opacity[layer] : 1) * (isFaint ? DIMMED : 1);
    const dash = path.kind === "model" && path.side === "right" ? RIGHT_DASH : style.dash;
    stroke(context, line, path.color, style.width, style.hasOutline && !isFaint, dash);
  }
  context.globalAlpha = 1;
}

/**
 * Number the ghosts of one view in their order, each at the middle of its lines.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {PaneView} view
 * @param {Overlay} overlay
 * @param {number} camera
 * @param {number} opacity
 */
export function drawGhostRanks(context, view, overlay, camera, opacity) {
  const ghosts = overlay.paths.filter((path) => path.camera === camera && path.kind === "alternative");
  context.globalAlpha = opacity;
  setText(context, "center", "middle", "600 11px");
  ghosts.forEach(({ first, count, color }, rank) => {
    if (count === 0) return;
    const lines = overlay.segments.subarray(4 * first, 4 * (first + count));
    const mean = (/** @type {number} */ at) => lines.reduce((sum, value, i) => (i % 4 === at ? sum + value : sum), 0) / count;
    const { x, y } = view.toScreen(mean(0), mean(1));
    context.fillStyle = "rgba(12, 13, 15, 0.85)";
    context.beginPath();
    context.roundRect(x - 7, y - 8, 14, 16, 3);
    context.fill();
    context.fillStyle = color;
    context.fillText(String(rank + 1), x, y + 0.5);
  });
  context.textAlign = "start";
  context.globalAlpha = 1;
}

/**
 * @param {PaneView} view
 * @param {Float32Array} segments
 * @param {number} first
 * @param {number} count
 */
function tracePath(view, segments, first, count) {
  const { x, y } = view.origin;
  const scale = view.scale;
  const line = new Path2D();
  for (let i = 4 * first, end = 4 * (first + count); i < end; i += 4) {
    // Consecutive segments form one line: its corners join, and drawing takes half the time.
    const goesOn = i > 4 * first && segments[i] === segments[i - 2] && segments[i + 1] === segments[i - 1];
    if (!goesOn) line.moveTo(x + scale * segments[i], y + scale * segments[i + 1]);
    line.lineTo(x + scale * segments[i + 2], y + scale * segments[i + 3]);
  }
  return line;
}

/**
 * Stroke with a dark outline, so that the line is visible on any image.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {Path2D} line
 * @param {string} color
 * @param {number} width
 * @param {boolean} hasOutline
 * @param {number[]} dash
 */
export function stroke(context, line, color, width, hasOutline = true, dash = []) {
  context.lineJoin = context.lineCap = "round";
  context.setLineDash(dash);
  if (hasOutline) {
    context.strokeStyle = imageColor("outline");
    context.lineWidth = width + 2;
    context.stroke(line);
  }
  context.strokeStyle = color;
  context.lineWidth = width;
  context.stroke(line);
  context.setLineDash([]);
}

/**
 * Highlight the part under the pointer.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {PaneView} view
 * @param {Overlay} overlay
 * @param {import("../model/protocol.js").Outline} outline
 * @param {string} color
 */
export function drawPart(context, view, overlay, outline, color) {
  const shape = tracePath(view, overlay.segments, outline.first, outline.count);
  context.globalAlpha = 0.28;
  context.fillStyle = color;
  context.fill(shape);
  context.globalAlpha = 1;
  stroke(context, shape, "#fff", 1.25);
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {PlacedHandle[]} placed
 * @param {import("../model/protocol.js").PersonInfo[]} people
 * @param {number} opacity
 */
export function drawSkeleton(context, placed, people, opacity) {
  people.forEach((person, index) => {
    const joints = new Map(placed.filter((p) => p.handle.person === index).map((p) => [p.handle.point, p]));
    const [solid, dashed] = [new Path2D(), new Path2D()];
    for (const [from, to] of person.bones) {
      const [a, b] = [joints.get(from), joints.get(to)];
      if (!a || !b) continue;
      addLine(b.handle.side === "right" ? dashed : solid, a, b);
    }
    context.globalAlpha = opacity;
    stroke(context, solid, imageColor("neutral"), 1.25);
    stroke(context, dashed, imageColor("neutral"), 1.25, true, RIGHT_DASH);
    context.globalAlpha = 1;
  });
}

/**
 * Draw a joint: a square for the torso, a diamond on the right of the body, else a disc. A ring marks a held joint. A joint
 * behind a dimmed person has a dashed border.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {PlacedHandle} placed
 * @param {string} color
 * @param {"plain" | "selected" | "hovered"} emphasis
 * @param {boolean} isSeen whether it is drawn as visible
 */
export function drawHandle(context, { handle, x, y }, color, emphasis, isSeen = handle.visible) {
  const outline = handleOutline(handle, x, y, emphasis === "hovered" ? 1.5 : 0);
  if (handle.held) stroke(context, circlePath(x, y, HELD_RADIUS), color, 2);
  // Hidden joints are rings in the person's colour, visible joints discs with a white ring.
  context.strokeStyle = imageColor("outline");
  context.lineWidth = 3.5;
  context.stroke(outline);
  if (isSeen) {
    context.fillStyle = color;
    context.fill(outline);
  }
  context.strokeStyle = isSeen || emphasis !== "plain" ? "#fff" : color;
  context.lineWidth = emphasis === "plain" ? 1.25 : 2.25;
  if (isSeen && !handle.visible) context.setLineDash(BEHIND_DASH);
  context.stroke(outline);
  context.setLineDash([]);
}

/**
 * @param {{point: string, side: import("../model/protocol.js").Side}} handle
 * @param {number} x
 * @param {number} y
 * @param {number} grown by how much it is larger than usual
 */
function handleOutline({ point, side }, x, y, grown) {
  if (point !== TORSO) return side === "right" ? diamondPath(x, y, DIAMOND_RADIUS + grown) : circlePath(x, y, JOINT_RADIUS + grown);
  const half = TORSO_HALF_SIDE + grown;
  const square = new Path2D();
  square.roundRect(x - half, y - half, 2 * half, 2 * half, 2);
  return square;
}

/**
 * Draw a dragged joint that stays behind the pointer: its handle at the pointer, a line to the limb, and the distance.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {PaneView} view
 * @param {import("../model/protocol.js").OutOfReach} outOfReach
 * @param {Handle | undefined} handle none for a part held by its surface
 * @param {string} color
 * @param {number} paneWidth
 */
export function drawOutOfReach(context, view, outOfReach, handle, color, paneWidth) {
  const wanted = view.toScreen(outOfReach.u, outOfReach.v);
  const reached = view.toScreen(outOfReach.point_u, outOfReach.point_v);
  stroke(context, addLine(new Path2D(), wanted, reached), imageColor("off"), 1.75, true, OFF_DASH);
  stroke(context, handleOutline(handle ?? { point: "", side: "" }, wanted.x, wanted.y, 1.5), color, 2.25);
  drawLabel(context, [`out of reach by ${Math.round(100 * outOfReach.distance_m)} cm`], { x: wanted.x, y: Math.max(wanted.y, CORNERS_PX) }, paneWidth);
}

/**
 * Draw lines of text beside a position, on the side with more room. The first line is bright.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {string[]} lines
 * @param {{x: number, y: number}} at
 * @param {number} paneWidth
 */
export function drawLabel(context, lines, { x, y }, paneWidth) {
  context.font = "500 12px system-ui, sans-serif";
  context.textBaseline = "middle";
  const widthOf = (/** @type {string} */ text) => context.measureText(text).width + 12;
  // In a narrow pane, what is in parentheses has a line of its own.
  lines = lines.flatMap((text) => (widthOf(text) < paneWidth ? [text] : text.replace(" (", "\n(").split("\n")));
  const width = Math.max(...lines.map(widthOf));
  let left = x + 14 + width < paneWidth ? x + 14 : x - 14 - width;
  if (left < 0) {
    left = Math.max(0, Math.min(x - width / 2, paneWidth - width));
    y += BELOW_JOINT_PX;
  }
  context.fillStyle = "rgba(12, 13, 15, 0.85)";
  context.beginPath();
  context.roundRect(left, y - 10, width, 4 + LABEL_LINE_PX * lines.length, 4);
  context.fill();
  lines.forEach((text, index) => {
    context.fillStyle = index === 0 ? "#fff" : "#c3c7cf";
    context.fillText(text, left + 6, y + 0.5 + LABEL_LINE_PX * index);
  });
}
