/** Pane of one camera: two canvases, labels in the corners, zoom and pan. */

import { prepare } from "../widgets/canvas.js";
import { make } from "../widgets/elements.js";
import * as drawing from "./drawing.js";
import { drawPins, isSame } from "./pin_drawing.js";
import { decluttered } from "./joint_picking.js";
import { ofJoint } from "../model/observability.js";
import { jointLabel } from "./joint_label.js";
import { drawObservability } from "./observability_marks.js";
import { drawAxes, drawEpipolar, drawMisfits } from "./measured_lines.js";
import { provenanceOf } from "../model/provenance.js";
import { isDimmed, isInSight, isStoredDrawn, alternativesOf } from "../model/selectors.js";
import { PICTURE_LAYERS } from "../model/layers.js";
import { isPlain } from "../model/image_tone.js";
import { makePaneCorner } from "./pane_corner.js";
import { PaneView } from "./pane_view.js";
import { outlineOf } from "./part_hit.js";
import { keyOf } from "../model/pictures.js";
import { makeTonedImage } from "./toned_image.js";
import { drawsInSoftware } from "../widgets/webgl.js";

// Software rendering composites one opaque canvas faster than two.
const IN_SOFTWARE = drawsInSoftware();
const WHEEL_ZOOM = 0.0015;
const PINCH_ZOOM = 0.01;
const LINE_PX = 16;
/** Below this width, labels are shortened. */
const NARROW_PX = 250;
/** Accepted range of picture pixels per displayed pixel, per side. Within it, resizing the pane does not request new
 * pictures. */
const [ENOUGH, MORE_THAN_ENOUGH] = [0.95, 1.25];

/** @typedef {ReturnType<typeof makePane>} Pane */

/**
 * @param {import("../model/store.js").Store} store
 * @param {number} camera
 * @param {import("../model/protocol.js").CameraInfo} info
 * @param {{viewChanged: () => void, openToneMenu: (camera: number, button: HTMLElement) => void}} run
 */
export function makePane(store, camera, info, { viewChanged, openToneMenu }) {
  const element = make("section", { className: "pane", "aria-label": `Camera ${info.name}` });
  const view = new PaneView(info.width, info.height);
  const image = make("canvas", "is-layer");
  const surface = make("canvas", "is-layer pane-overlay");
  const toned = makeTonedImage();
  let size = { width: 0, height: 0 };
  let reduced = 1;
  let redrawScheduled = false;
  const corner = makePaneCorner(camera, info.name, { reset, openToneMenu: (button) => openToneMenu(camera, button) });
  if (!IN_SOFTWARE) element.append(image);
  element.append(surface, ...corner.elements);
  element.addEventListener("wheel", zoom, { passive: false });

  /**
   * Image pixels per displayed pixel, per side, that this pane needs; 0 if it is not visible. Reduced pictures are sent and
   * drawn much faster than full images.
   */
  function reduction() {
    if (size.width === 0 || size.height === 0) return 0;
    const shown = view.scale * devicePixelRatio;
    const share = 1 / (reduced * shown);
    const isKept = reduced > 1 ? share >= ENOUGH && share <= MORE_THAN_ENOUGH : shown > ENOUGH;
    if (!isKept) reduced = Math.max(1, 1 / shown);
    return reduced;
  }

  /** Reset zoom and pan. */
  function reset() {
    view.reset();
    redraw();
  }

  /**
   * Zoom to a box; without one, show the whole image.
   *
   * @param {import("./pane_view.js").ImageBox | null} box
   */
  function frame(box) {
    if (box) view.frame(box);
    else view.reset();
    redraw();
  }

  /**
   * Show an image position in the middle at a scale, CSS pixels per image pixel.
   *
   * @param {{u: number, v: number}} center
   * @param {number} scale
   */
  function look(center, scale) {
    view.look(center, scale);
    redraw();
  }

  /**
   * @param {number} dx
   * @param {number} dy
   */
  function panBy(dx, dy) {
    view.panBy(dx, dy);
    redraw();
  }

  /**
   * Position of a pointer event in the pane, CSS pixels.
   *
   * @param {MouseEvent} event
   */
  function locate(event) {
    const box = surface.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  }

  /** Joints of this view that can be dragged, with their positions in the pane. Dimmed people and the bare picture have none. */
  function graspableHandles() {
    const { session, hover, dragging, state, bare } = store.facts;
    if (bare || !isStoredDrawn(state)) return [];
    const placed = placedHandles().filter(({ handle }) => !isDimmed(state, handle.person));
    return decluttered(placed, session?.people ?? [], dragging ? hover : null);
  }

  /** Circles around the heads of all people. */
  function heads() {
    const heads = (store.facts.overlay?.heads ?? []).filter((head) => head.camera === camera);
    return heads.map(({ u, v, radius_px }) => {
      const [middle, side] = [view.toScreen(u, v), view.toScreen(u + radius_px, v)];
      return { ...middle, radius: side.x - middle.x };
    });
  }

  /** All joints of this view, with their positions in the pane. */
  function placedHandles() {
    const handles = (store.facts.overlay?.handles ?? []).filter((handle) => handle.camera === camera);
    return handles.map((handle) => ({ handle, ...view.toScreen(handle.u, handle.v) }));
  }

  /**
   * Move the pane to its place in the grid. Hidden panes free their canvases.
   *
   * @param {import("../layout/grid_layout.js").Box | null} box
   */
  function place(box) {
    const { x, y, width, height } = box ?? { x: 0, y: 0, width: 0, height: 0 };
    element.hidden = box === null;
    Object.assign(element.style, { left: `${x}px`, top: `${y}px`, width: `${width}px`, height: `${height}px` });
    element.classList.toggle("is-narrow", width < NARROW_PX);
    size = { width, height };
    view.resize(width, height);
    if (box) draw(true);
    else image.width = image.height = surface.width = surface.height = 0;
  }

  /** Draw on the next animation frame, once for all moves of the view until then. */
  function redraw() {
    if (redrawScheduled) return;
    redrawScheduled = true;
    requestAnimationFrame(() => {
      redrawScheduled = false;
      draw(true);
      viewChanged();
    });
  }

  /**
   * Draw now, within an animation frame.
   *
   * @param {boolean} withPictures whether the pictures below the vectors changed too
   */
  function draw(withPictures) {
    const { width, height } = size;
    const { state, session, overlay, layers, placeholder, bare } = store.facts;
    if (width === 0 || height === 0) return;
    if (withPictures) drawPictures();
    const context = prepare(surface, width, height, true);
    if (IN_SOFTWARE) context.drawImage(image, 0, 0, width, height);
    if (layers.shown.faces) drawing.drawGrains(context, image, placeholder?.pictures ? null : heads());
    corner.showPlaceholder(placeholder);
    if (!state || !session || !overlay || placeholder?.pictures) return;
    showJoint(state);
    if (bare) return;
    drawing.drawPaths(context, view, overlay, camera, layers, (person) => isDimmed(state, person));
    if (layers.shown.contours && layers.shown.alternatives && alternativesOf(store.facts).length > 0) {
      drawing.drawGhostRanks(context, view, overlay, camera, layers.opacity.alternatives);
    }
    drawAxes(context, view, store.facts, camera);
    drawJoints(context, state, session.people);
    drawPins(context, view, store.facts, camera, width);
    drawMisfits(context, view, store.facts, camera);
    drawEpipolar(context, view, store.facts, camera);
  }

  const showCost = () => corner.showCost(store.facts.state?.view_costs_px[camera] ?? null);

  function drawPictures() {
    const { width, height } = size;
    const { shown, placeholder, layers, imageTones, bare } = store.facts;
    const pictures = placeholder?.pictures ?? shown?.pictures;
    const context = prepare(image, width, height, IN_SOFTWARE);
    drawing.drawBackground(context, view);
    /** @type {number | null} */
    let limitPx = null;
    for (const layer of PICTURE_LAYERS) {
      const isShown = bare ? layer === "image" : layers.shown[layer];
      const picture = isShown ? pictures?.get(keyOf(layer, camera)) : undefined;
      if (!picture) continue;
      const source = layer === "image" ? toned(picture.bitmap, imageTones[camera]) : picture.bitmap;
      drawing.drawPicture(context, view, source, layers.opacity[layer]);
      limitPx ??= picture.limitPx;
    }
    corner.showScale(limitPx, width);
    corner.showZoom(view.isReset);
    corner.showTone(!isPlain(imageTones[camera]));
  }

  /** @param {import("../model/protocol.js").StateMessage} state */
  function showJoint({ person, point }) {
    const { overlay, session } = store.facts;
    const handle = overlay?.handles.find((one) => isSame(one, { camera, person, point }));
    const { width, height } = info;
    const isInside = handle && handle.u >= -0.5 && handle.v >= -0.5 && handle.u < width - 0.5 && handle.v < height - 0.5;
    const by = handle && handle.hidden_by !== null ? session?.people[handle.hidden_by].name : undefined;
    corner.showJoint(point, !isInside ? "outside" : isInSight(store.facts.state, handle) ? "visible" : "hidden", by);
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {import("../model/protocol.js").StateMessage} state
   * @param {import("../model/protocol.js").PersonInfo[]} people
   */
  function drawJoints(context, state, people) {
    const { hover, layers, overlay } = store.facts;
    if (layers.shown.skeleton) {
      const undimmed = placedHandles().filter(({ handle }) => !isDimmed(state, handle.person));
      drawing.drawSkeleton(context, undimmed, people, layers.opacity.skeleton);
    }
    if (!layers.shown.joints) return;
    drawHoveredPart(context, people);
    /** @type {drawing.PlacedHandle | null} */
    let named = null;
    context.globalAlpha = layers.opacity.joints;
    const isMeant = (/** @type {drawing.PlacedHandle} */ { handle }) =>
      hover?.person === handle.person && hover.point === handle.point;
    // The joint that a press takes is drawn over the joints that overlap it.
    for (const one of graspableHandles().sort((a, b) => Number(isMeant(a)) - Number(isMeant(b)))) {
      const isHovered = isMeant(one);
      const isSelected = state.person === one.handle.person && state.point === one.handle.point;
      if (isHovered && hover?.camera === camera) named = one;
      const color = people[one.handle.person]?.color ?? "#fff";
      const observed = ofJoint(store.facts, one.handle);
      if (observed) drawObservability(context, one, observed.level, layers.opacity.observability);
      drawing.drawHandle(context, one, color, isHovered ? "hovered" : isSelected ? "selected" : "plain", isInSight(state, one.handle));
    }
    context.globalAlpha = 1;
    if (named && !overlay?.out_of_reach) drawing.drawLabel(context, labelOf(named, people), named, size.width);
    drawOutOfReach(context, people);
  }

  /**
   * @param {drawing.PlacedHandle} named the joint under the pointer
   * @param {import("../model/protocol.js").PersonInfo[]} people
   */
  function labelOf(named, people) {
    const { hover, dragging } = store.facts;
    const offered = (dragging ? null : hover?.overlapping) ?? [];
    const overlapping = graspableHandles().filter(({ handle }) =>
      offered.some(({ person, point }) => person === handle.person && point === handle.point),
    );
    const observed = ofJoint(store.facts, named.handle);
    const origin = dragging ? [] : provenanceOf(store.facts, named.handle);
    return [...jointLabel(named, overlapping, people), ...origin, ...(observed ? observed.sentence.split(/(?<=:) /) : [])];
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {import("../model/protocol.js").PersonInfo[]} people
   */
  function drawOutOfReach(context, people) {
    const { overlay } = store.facts;
    const short = overlay?.out_of_reach;
    if (!overlay || short?.camera !== camera) return;
    const handle = overlay.handles.find((one) => isSame(one, short));
    const color = people[short.person]?.color ?? "#fff";
    drawing.drawOutOfReach(context, view, short, handle, color, size.width);
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {import("../model/protocol.js").PersonInfo[]} people
   */
  function drawHoveredPart(context, people) {
    const { hoverPart, overlay } = store.facts;
    if (!overlay || hoverPart?.camera !== camera) return;
    const outline = outlineOf(overlay, hoverPart);
    if (outline) drawing.drawPart(context, view, overlay, outline, people[outline.person]?.color ?? "#fff");
  }

  /** @param {WheelEvent} event */
  function zoom(event) {
    event.preventDefault();
    const { x, y } = locate(event);
    const delta = event.deltaY * (event.deltaMode === WheelEvent.DOM_DELTA_LINE ? LINE_PX : 1);
    // Browsers report a pinch as a wheel event with the Ctrl key.
    view.zoomAt(x, y, Math.exp(-delta * (event.ctrlKey ? PINCH_ZOOM : WHEEL_ZOOM)));
    store.set({ hover: null });
    redraw();
  }

  const { toneButton } = corner;
  return { element, view, surface, toneButton, reduction, reset, frame, look, panBy, locate, graspableHandles, place, draw, showCost };
}
