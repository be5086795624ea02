/** Draw the pins of a view, their distance to the model, and their triangulated point. All sizes are CSS pixels. */

import { addLine, circlePath, diamondPath } from "../widgets/canvas.js";
import { drawLabel, stroke } from "./drawing.js";
import { displayName } from "../widgets/text.js";
import { OFF_DASH, imageColor } from "../widgets/image_colors.js";

/**
 * @typedef {import("../model/protocol.js").PinMark} PinMark
 * @typedef {{pin: PinMark, x: number, y: number, headX: number, headY: number}} PlacedPin
 */

/** Opacity of the pins of other people. */
const OTHERS = 0.4;
const STEM = 15;
const HEAD_RADIUS = 5;
/** Picking radius of a pin's head. */
export const HEAD_REACH = 9;
/** Picking radius of a pin's point, where no joint is nearer. */
export const POINT_REACH = 6;
const MEETING_RADIUS = 5;
const MIN_ERROR_PX = 2;

/**
 * The pins of a view with their positions in the pane. The dragged pin is at the pointer. The head is above the point, so
 * that it can be picked where a joint covers the point; at the upper border it is below.
 *
 * @param {import("../model/store.js").Facts} facts
 * @param {import("./pane_view.js").PaneView} view
 * @param {number} camera
 * @returns {PlacedPin[]}
 */
export function placedPins({ overlay, heldPin }, view, camera) {
  const pins = (overlay?.pins ?? []).filter((pin) => pin.camera === camera && !isSame(pin, heldPin));
  if (heldPin?.camera === camera) pins.push(heldPin);
  return pins.map((pin) => {
    const { x, y } = view.toScreen(pin.u, pin.v);
    return { pin, x, y, headX: x, headY: y < STEM + 2 * HEAD_RADIUS ? y + STEM : y - STEM };
  });
}

/**
 * @param {{camera: number, person: number, point: string}} a
 * @param {{camera: number, person: number, point: string | null} | null} b
 */
export function isSame(a, b) {
  return a.camera === b?.camera && a.person === b.person && a.point === b.point;
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {import("./pane_view.js").PaneView} view
 * @param {import("../model/store.js").Facts} facts
 * @param {number} camera
 * @param {number} paneWidth
 */
export function drawPins(context, view, facts, camera, paneWidth) {
  const { state, session, pinHover, overlay } = facts;
  if (!state || !session) return;
  const isChosen = (/** @type {PlacedPin} */ { pin }) => pin.person === state.person && pin.point === state.point;
  // Pins of other people are drawn first, pins of the selected joint last.
  const rank = (/** @type {PlacedPin} */ one) => Number(one.pin.person === state.person) + Number(isChosen(one));
  const placed = placedPins(facts, view, camera).sort((a, b) => rank(a) - rank(b));
  const strengthOf = (/** @type {PlacedPin} */ { pin }) => (pin.person === state.person ? 1 : OTHERS);
  for (const one of placed) {
    context.globalAlpha = strengthOf(one);
    drawError(context, view, one);
  }
  context.globalAlpha = 1;
  drawMeeting(context, view, overlay, camera, paneWidth);
  for (const one of placed) {
    const color = isChosen(one) ? imageColor("mark") : (session.people[one.pin.person]?.color ?? "#fff");
    context.globalAlpha = isSame(one.pin, pinHover) ? 1 : strengthOf(one);
    drawPin(context, one, color, isSame(one.pin, pinHover) || isSame(one.pin, facts.heldPin));
  }
  context.globalAlpha = 1;
  const named = placed.find(({ pin }) => isSame(pin, pinHover));
  if (named && !facts.heldPin) {
    const hint = "drag to move, right-click or Delete to remove";
    drawLabel(context, [describe(named.pin), hint], { x: named.headX, y: named.headY }, paneWidth);
  }
}

/** @param {PinMark} pin */
function describe({ point, u, v, model_u, model_v }) {
  const off = model_u === null || model_v === null ? "" : `, model ${Math.hypot(model_u - u, model_v - v).toFixed(1)} px off`;
  return `Pin ${displayName(point)}${off}`;
}

/**
 * Draw the line from a pin to the joint of the model.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {import("./pane_view.js").PaneView} view
 * @param {PlacedPin} placed
 */
function drawError(context, view, { pin, x, y }) {
  if (pin.model_u === null || pin.model_v === null) return;
  const model = view.toScreen(pin.model_u, pin.model_v);
  if (Math.hypot(model.x - x, model.y - y) < MIN_ERROR_PX) return;
  stroke(context, addLine(new Path2D(), { x, y }, model), imageColor("off"), 1.5, true, OFF_DASH);
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {PlacedPin} placed
 * @param {string} color
 * @param {boolean} isGrown
 */
function drawPin(context, { x, y, headX, headY }, color, isGrown) {
  const radius = HEAD_RADIUS + (isGrown ? 1.5 : 0);
  stroke(context, addLine(new Path2D(), { x, y }, { x: headX, y: headY }), "#fff", 1.5);
  const head = circlePath(headX, headY, radius);
  context.strokeStyle = imageColor("outline");
  context.lineWidth = 3.5;
  context.stroke(head);
  context.fillStyle = color;
  context.fill(head);
  context.strokeStyle = "#fff";
  context.lineWidth = 1.5;
  context.stroke(head);
}

/**
 * Draw the triangulated point of the selected joint's pins, and its distance to the pin of this view.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {import("./pane_view.js").PaneView} view
 * @param {import("../model/protocol.js").Overlay | null} overlay
 * @param {number} camera
 * @param {number} paneWidth
 */
function drawMeeting(context, view, overlay, camera, paneWidth) {
  const mark = overlay?.triangulation?.marks.find((one) => one.camera === camera);
  if (!mark) return;
  const { x, y } = view.toScreen(mark.u, mark.v);
  stroke(context, diamondPath(x, y, MEETING_RADIUS), imageColor("mark"), 1.5);
  if (mark.error_px !== null) drawLabel(context, [`${mark.error_px.toFixed(1)} px`], { x, y: y + 16 }, paneWidth);
}
