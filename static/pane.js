/** One camera's pane: two canvases, its labels, zoom and pan. */

import * as drawing from "./drawing.js";
import { uncrowded } from "./crowding.js";
import { PaneView } from "./pane_view.js";
import { px } from "./text.js";
import { drawsInSoftware } from "./webgl.js";

// Without a graphics card one opaque canvas is laid on the screen sooner than a transparent one over another.
const IN_SOFTWARE = drawsInSoftware();
const WHEEL_ZOOM = 0.0015;
const PINCH_ZOOM = 0.01;
const LINE_PX = 16;

export class Pane {
  element = document.createElement("section");
  view;
  #store;
  #camera;
  #image = document.createElement("canvas");
  #overlay = document.createElement("canvas");
  #cost = document.createElement("output");
  #reset = document.createElement("button");
  #size = { width: 0, height: 0 };
  #redrawScheduled = false;

  /**
   * @param {import("./store.js").Store} store
   * @param {number} camera
   * @param {import("./protocol.js").CameraInfo} info
   */
  constructor(store, camera, info) {
    this.#store = store;
    this.#camera = camera;
    this.view = new PaneView(info.width, info.height);
    this.element.className = "pane";
    this.element.setAttribute("aria-label", `Camera ${info.name}`);
    this.#overlay.className = "pane-overlay";

    const label = document.createElement("div");
    label.className = "pane-label";
    const number = document.createElement("kbd");
    number.textContent = camera < 9 ? String(camera + 1) : "";
    number.hidden = camera >= 9;
    const name = document.createElement("span");
    name.textContent = info.name;
    label.append(number, name);

    this.#cost.className = "pane-cost";
    this.#cost.title = "Chamfer cost of this view, in pixels";
    this.#reset.className = "pane-reset";
    this.#reset.type = "button";
    this.#reset.textContent = "Fit";
    this.#reset.title = "Show the whole image (0)";
    this.#reset.setAttribute("aria-label", `Show the whole image of ${info.name}`);
    this.#reset.addEventListener("click", () => this.reset());

    if (!IN_SOFTWARE) this.element.append(this.#image);
    this.element.append(this.#overlay, label, this.#cost, this.#reset);
    this.#overlay.addEventListener("wheel", (event) => this.#zoom(event), { passive: false });
  }

  /** The element that takes the pointer. */
  get surface() {
    return this.#overlay;
  }

  /** Show the whole image. */
  reset() {
    this.view.reset();
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
   * Screen position, in CSS pixels of the pane, of a pointer event.
   *
   * @param {MouseEvent} event
   */
  locate(event) {
    const box = this.#overlay.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  }

  /** The joints that a hand can take in this view, and where they lie in the pane; none while they are switched off. */
  graspableHandles() {
    const { session, hover, dragging } = this.#store.facts;
    return uncrowded(this.#placedHandles(), session?.people ?? [], dragging ? hover : null);
  }

  /** All joints of this view, and where they lie in the pane. */
  #placedHandles() {
    const handles = this.#store.facts.overlay?.handles ?? [];
    return handles
      .filter((handle) => handle.camera === this.#camera)
      .map((handle) => ({ handle, ...this.view.toScreen(handle.u, handle.v) }));
  }

  /**
   * Take over the size that the layout gave; canvases that show nothing keep no memory.
   *
   * @param {number} width
   * @param {number} height
   */
  resize(width, height) {
    this.#size = { width, height };
    this.view.resize(width, height);
    this.draw(true);
  }

  /** Draw once on the next animation frame, however often the view moves before it. */
  #redraw() {
    if (this.#redrawScheduled) return;
    this.#redrawScheduled = true;
    requestAnimationFrame(() => {
      this.#redrawScheduled = false;
      this.draw(true);
    });
  }

  /**
   * Draw now; called within an animation frame.
   *
   * @param {boolean} withImage whether the image layer changed too
   */
  draw(withImage) {
    const { width, height } = this.#size;
    const { shown, state, session, overlay } = this.#store.facts;
    if (width === 0 || height === 0) return;
    if (withImage) {
      const context = drawing.prepare(this.#image, width, height, IN_SOFTWARE);
      const bitmap = shown?.bitmaps[this.#camera];
      if (bitmap) drawing.drawImage(context, this.view, bitmap);
      this.#reset.classList.toggle("is-shown", !this.view.isReset);
      this.#reset.tabIndex = this.view.isReset ? -1 : 0;
    }
    const context = drawing.prepare(this.#overlay, width, height, true);
    if (IN_SOFTWARE) context.drawImage(this.#image, 0, 0, width, height);
    if (!state || !session || !overlay) return;
    drawing.drawPaths(context, this.view, overlay, this.#camera, state.overlays);
    this.#drawJoints(context, state, session.people);
  }

  showCost() {
    const cost = this.#store.facts.state?.view_costs_px[this.#camera] ?? null;
    this.#cost.textContent = px(cost);
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {import("./protocol.js").StateMessage} state
   * @param {import("./protocol.js").PersonInfo[]} people
   */
  #drawJoints(context, state, people) {
    if (state.overlays.skeleton) drawing.drawSkeleton(context, this.#placedHandles(), people);
    if (!state.overlays.joints) return;
    const { hover } = this.#store.facts;
    /** @type {drawing.PlacedHandle | null} */
    let named = null;
    for (const one of this.graspableHandles()) {
      const isHovered = hover?.person === one.handle.person && hover.point === one.handle.point;
      const isSelected = state.person === one.handle.person && state.point === one.handle.point;
      if (isHovered && hover.camera === this.#camera) named = one;
      const color = people[one.handle.person]?.color ?? "#fff";
      drawing.drawHandle(context, one, color, isHovered ? "hovered" : isSelected ? "selected" : "plain");
    }
    if (named) drawing.drawName(context, named, this.#size.width);
  }

  /** @param {WheelEvent} event */
  #zoom(event) {
    event.preventDefault();
    const { x, y } = this.locate(event);
    const delta = event.deltaY * (event.deltaMode === WheelEvent.DOM_DELTA_LINE ? LINE_PX : 1);
    // Browsers report a pinch as a wheel with the control key held.
    this.view.zoomAt(x, y, Math.exp(-delta * (event.ctrlKey ? PINCH_ZOOM : WHEEL_ZOOM)));
    this.#store.set({ hover: null });
    this.#redraw();
  }
}
