/** Pane of one camera: two canvases, labels in the corners, zoom and pan. */

import { make } from "../widgets/elements.js";
import * as drawing from "./drawing.js";
import { drawPins } from "./pin_drawing.js";
import { decluttered } from "./joint_picking.js";
import { ofJoint } from "../model/observability.js";
import { jointLabel } from "./joint_label.js";
import { drawObservability } from "./observability_marks.js";
import { drawAxes, drawEpipolar, drawMisfits } from "./measured_lines.js";
import { provenanceOf } from "../model/provenance.js";
import { isDimmed, isInSight, isStoredDrawn, alternativesOf } from "../model/selectors.js";
import { PICTURE_LAYERS } from "../model/layers.js";
import { isPlain } from "../model/image_tone.js";
import { PaneCorner } from "./pane_corner.js";
import { PaneView } from "./pane_view.js";
import { keyOf } from "../model/pictures.js";
import { TonedImage } from "./toned_image.js";
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

export class Pane {
  element = make("section", "pane");
  view;
  #store;
  #camera;
  #info;
  #image = make("canvas", "is-layer");
  #overlay = make("canvas", "is-layer pane-overlay");
  #corner;
  #tonedImage = new TonedImage();
  #onView;
  #size = { width: 0, height: 0 };
  #reduction = 1;
  #redrawScheduled = false;

  /**
   * @param {import("../model/store.js").Store} store
   * @param {number} camera
   * @param {import("../model/protocol.js").CameraInfo} info
   * @param {{viewChanged: () => void, openToneMenu: (camera: number, button: HTMLElement) => void}} run
   */
  constructor(store, camera, info, { viewChanged, openToneMenu }) {
    this.#store = store;
    this.#camera = camera;
    this.#info = info;
    this.#onView = viewChanged;
    this.view = new PaneView(info.width, info.height);
    this.element.setAttribute("aria-label", `Camera ${info.name}`);
    this.#corner = new PaneCorner(camera, info.name, {
      reset: () => this.reset(),
      openToneMenu: (button) => openToneMenu(camera, button),
    });
    if (!IN_SOFTWARE) this.element.append(this.#image);
    this.element.append(this.#overlay, ...this.#corner.elements);
    this.element.addEventListener("wheel", (event) => this.#zoom(event), { passive: false });
  }

  /** The element that receives pointer events. */
  get surface() {
    return this.#overlay;
  }

  get toneButton() {
    return this.#corner.toneButton;
  }

  /**
   * Image pixels per displayed pixel, per side, that this pane needs; 0 if it is not visible. Reduced pictures are sent and
   * drawn much faster than full images.
   */
  get reduction() {
    if (this.#size.width === 0 || this.#size.height === 0) return 0;
    const shown = this.view.scale * devicePixelRatio;
    const share = 1 / (this.#reduction * shown);
    const isKept = this.#reduction > 1 ? share >= ENOUGH && share <= MORE_THAN_ENOUGH : shown > ENOUGH;
    if (!isKept) this.#reduction = Math.max(1, 1 / shown);
    return this.#reduction;
  }

  /** Reset zoom and pan. */
  reset() {
    this.view.reset();
    this.#redraw();
  }

  /**
   * Zoom to a box; without one, show the whole image.
   *
   * @param {import("./pane_view.js").ImageBox | null} box
   */
  frame(box) {
    if (box) this.view.frame(box);
    else this.view.reset();
    this.#redraw();
  }

  /**
   * Keep a framed box in view that has moved with the frame. The caller draws.
   *
   * @param {import("./pane_view.js").ImageBox} box
   */
  refit(box) {
    this.view.refit(box);
  }

  /**
   * Move the view with what it shows, image pixels. The caller draws.
   *
   * @param {{du: number, dv: number}} way
   */
  follow({ du, dv }) {
    this.view.follow(du, dv);
  }

  /**
   * Show an image position in the middle at a scale, CSS pixels per image pixel.
   *
   * @param {{u: number, v: number}} center
   * @param {number} scale
   */
  look(center, scale) {
    this.view.look(center, scale);
    this.#redraw();
  }

  /**
   * @param {number} dx
   * @param {number} dy
   */
  panBy(dx, dy) {
    this.view.panBy(dx, dy);
    this.#redraw();
  }

  /**
   * Position of a pointer event in the pane, CSS pixels.
   *
   * @param {MouseEvent} event
   */
  locate(event) {
    const box = this.#overlay.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  }

  /** Joints of this view that can be dragged, with their positions in the pane. Dimmed people and the bare picture have none. */
  graspableHandles() {
    const { session, hover, dragging, state, bare } = this.#store.facts;
    if (bare || !isStoredDrawn(state)) return [];
    const placed = this.#placedHandles().filter(({ handle }) => !isDimmed(state, handle.person));
    return decluttered(placed, session?.people ?? [], dragging ? hover : null);
  }

  /** Circles around the heads of all people. */
  #heads() {
    const heads = (this.#store.facts.overlay?.heads ?? []).filter(({ camera }) => camera === this.#camera);
    return heads.map(({ u, v, radius_px }) => {
      const [middle, side] = [this.view.toScreen(u, v), this.view.toScreen(u + radius_px, v)];
      return { ...middle, radius: side.x - middle.x };
    });
  }

  /** All joints of this view, with their positions in the pane. */
  #placedHandles() {
    const handles = this.#store.facts.overlay?.handles ?? [];
    return handles
      .filter((handle) => handle.camera === this.#camera)
      .map((handle) => ({ handle, ...this.view.toScreen(handle.u, handle.v) }));
  }

  /**
   * Move the pane to its place in the grid. Hidden panes free their canvases.
   *
   * @param {import("../layout/grid_layout.js").Box | null} box
   */
  place(box) {
    const { x, y, width, height } = box ?? { x: 0, y: 0, width: 0, height: 0 };
    this.element.hidden = box === null;
    Object.assign(this.element.style, { left: `${x}px`, top: `${y}px`, width: `${width}px`, height: `${height}px` });
    this.element.classList.toggle("is-narrow", width < NARROW_PX);
    this.#size = { width, height };
    this.view.resize(width, height);
    if (box) this.draw(true);
    else this.#image.width = this.#image.height = this.#overlay.width = this.#overlay.height = 0;
  }

  /** Draw on the next animation frame, once for all moves of the view until then. */
  #redraw() {
    if (this.#redrawScheduled) return;
    this.#redrawScheduled = true;
    requestAnimationFrame(() => {
      this.#redrawScheduled = false;
      this.draw(true);
      this.#onView();
    });
  }

  /**
   * Draw now, within an animation frame.
   *
   * @param {boolean} withPictures whether the pictures below the vectors changed too
   */
  draw(withPictures) {
    const { width, height } = this.#size;
    const { state, session, overlay, layers, placeholder, bare } = this.#store.facts;
    if (width === 0 || height === 0) return;
    if (withPictures) this.#drawPictures();
    const context = drawing.prepare(this.#overlay, width, height, true);
    if (IN_SOFTWARE) context.drawImage(this.#image, 0, 0, width, height);
    if (layers.shown.faces) drawing.drawGrains(context, this.#image, placeholder?.pictures ? null : this.#heads());
    this.#corner.showPlaceholder(placeholder);
    if (!state || !session || !overlay || placeholder?.pictures) return;
    this.#showJoint(state);
    if (bare) return;
    drawing.drawPaths(context, this.view, overlay, this.#camera, layers, (person) => isDimmed(state, person));
    if (layers.shown.contours && layers.shown.alternatives && alternativesOf(this.#store.facts).length > 0) {
      drawing.drawGhostRanks(context, this.view, overlay, this.#camera, layers.opacity.alternatives);
    }
    drawAxes(context, this.view, this.#store.facts, this.#camera);
    this.#drawJoints(context, state, session.people);
    drawPins(context, this.view, this.#store.facts, this.#camera, width);
    drawMisfits(context, this.view, this.#store.facts, this.#camera);
    drawEpipolar(context, this.view, this.#store.facts, this.#camera);
  }

  showCost() {
    this.#corner.showCost(this.#store.facts.state?.view_costs_px[this.#camera] ?? null);
  }

  #drawPictures() {
    const { width, height } = this.#size;
    const { shown, placeholder, layers, imageTones, bare } = this.#store.facts;
    const pictures = placeholder?.pictures ?? shown?.pictures;
    const context = drawing.prepare(this.#image, width, height, IN_SOFTWARE);
    drawing.drawBackground(context, this.view);
    /** @type {number | null} */
    let limitPx = null;
    for (const layer of PICTURE_LAYERS) {
      const isShown = bare ? layer === "image" : layers.shown[layer];
      const picture = isShown ? pictures?.get(keyOf(layer, this.#camera)) : undefined;
      if (!picture) continue;
      const source = layer === "image" ? this.#tonedImage.of(picture.bitmap, imageTones[this.#camera]) : picture.bitmap;
      drawing.drawPicture(context, this.view, source, layers.opacity[layer]);
      limitPx ??= picture.limitPx;
    }
    this.#corner.showScale(limitPx, width);
    this.#corner.showZoom(this.view.isReset);
    this.#corner.showTone(!isPlain(imageTones[this.#camera]));
  }

  /** @param {import("../model/protocol.js").StateMessage} state */
  #showJoint({ person, point }) {
    const { overlay, session } = this.#store.facts;
    const handle = overlay?.handles.find((h) => h.camera === this.#camera && h.person === person && h.point === point);
    const { width, height } = this.#info;
    const isInside = handle && handle.u >= -0.5 && handle.v >= -0.5 && handle.u < width - 0.5 && handle.v < height - 0.5;
    const by = handle && handle.hidden_by !== null ? session?.people[handle.hidden_by].name : undefined;
    this.#corner.showJoint(point, !isInside ? "outside" : isInSight(this.#store.facts.state, handle) ? "visible" : "hidden", by);
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {import("../model/protocol.js").StateMessage} state
   * @param {import("../model/protocol.js").PersonInfo[]} people
   */
  #drawJoints(context, state, people) {
    const { hover, layers, overlay } = this.#store.facts;
    if (layers.shown.skeleton) {
      const undimmed = this.#placedHandles().filter(({ handle }) => !isDimmed(state, handle.person));
      drawing.drawSkeleton(context, undimmed, people, layers.opacity.skeleton);
    }
    if (!layers.shown.joints) return;
    this.#drawHoveredPart(context, people);
    /** @type {drawing.PlacedHandle | null} */
    let named = null;
    context.globalAlpha = layers.opacity.joints;
    const isMeant = (/** @type {drawing.PlacedHandle} */ { handle }) =>
      hover?.person === handle.person && hover.point === handle.point;
    // The joint that a press takes is drawn over the joints that overlap it.
    for (const one of this.graspableHandles().sort((a, b) => Number(isMeant(a)) - Number(isMeant(b)))) {
      const isHovered = isMeant(one);
      const isSelected = state.person === one.handle.person && state.point === one.handle.point;
      if (isHovered && hover?.camera === this.#camera) named = one;
      const color = people[one.handle.person]?.color ?? "#fff";
      const observed = ofJoint(this.#store.facts, one.handle);
      if (observed) drawObservability(context, one, observed.level, layers.opacity.observability);
      drawing.drawHandle(context, one, color, isHovered ? "hovered" : isSelected ? "selected" : "plain", isInSight(state, one.handle));
    }
    context.globalAlpha = 1;
    if (named && !overlay?.out_of_reach) drawing.drawLabel(context, this.#labelOf(named, people), named, this.#size.width);
    this.#drawOutOfReach(context, people);
  }

  /**
   * @param {drawing.PlacedHandle} named the joint under the pointer
   * @param {import("../model/protocol.js").PersonInfo[]} people
   */
  #labelOf(named, people) {
    const { hover, dragging } = this.#store.facts;
    const offered = (dragging ? null : hover?.overlapping) ?? [];
    const overlapping = this.graspableHandles().filter(({ handle }) =>
      offered.some(({ person, point }) => person === handle.person && point === handle.point),
    );
    const observed = ofJoint(this.#store.facts, named.handle);
    const origin = dragging ? [] : provenanceOf(this.#store.facts, named.handle);
    return [...jointLabel(named, overlapping, people), ...origin, ...(observed ? observed.sentence.split(/(?<=:) /) : [])];
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {import("../model/protocol.js").PersonInfo[]} people
   */
  #drawOutOfReach(context, people) {
    const { overlay } = this.#store.facts;
    const short = overlay?.out_of_reach;
    if (!overlay || short?.camera !== this.#camera) return;
    const handle = overlay.handles.find(
      ({ camera, person, point }) => camera === short.camera && person === short.person && point === short.point,
    );
    const color = people[short.person]?.color ?? "#fff";
    drawing.drawOutOfReach(context, this.view, short, handle, color, this.#size.width);
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {import("../model/protocol.js").PersonInfo[]} people
   */
  #drawHoveredPart(context, people) {
    const { hoverPart, overlay } = this.#store.facts;
    if (!overlay || hoverPart?.camera !== this.#camera) return;
    const outline = overlay.outlines.find(
      ({ camera, person, part }) => camera === this.#camera && person === hoverPart.person && part === hoverPart.part,
    );
    if (outline) drawing.drawPart(context, this.view, overlay, outline, people[outline.person]?.color ?? "#fff");
  }

  /** @param {WheelEvent} event */
  #zoom(event) {
    event.preventDefault();
    const { x, y } = this.locate(event);
    const delta = event.deltaY * (event.deltaMode === WheelEvent.DOM_DELTA_LINE ? LINE_PX : 1);
    // Browsers report a pinch as a wheel event with the Ctrl key.
    this.view.zoomAt(x, y, Math.exp(-delta * (event.ctrlKey ? PINCH_ZOOM : WHEEL_ZOOM)));
    this.#store.set({ hover: null });
    this.#redraw();
  }
}
