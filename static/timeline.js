/**
 * One cell per frame, coloured by who set it, with its status and cost above it. A click or a drag goes there; with Shift it
 * marks a range of frames.
 */

import { prepare } from "./drawing.js";
import { FrameAxis } from "./frame_axis.js";
import { px } from "./text.js";
import * as drawing from "./timeline_drawing.js";

/** The sources of a pose, in the order of the legend; their colours are in style.css. */
export const SOURCES = [
  "manual",
  "pinned",
  "searched",
  "fitted",
  "tracked",
  "interpolated",
  "smoothed",
  "imported",
];

export class Timeline {
  #element;
  #store;
  #navigation;
  #cells = document.createElement("canvas");
  #cursor = document.createElement("canvas");
  #hovered = /** @type {number | null} */ (null);
  /** Where a range began that is being marked. */
  #marked = /** @type {number | null} */ (null);

  /**
   * @param {HTMLElement} element
   * @param {import("./store.js").Store} store
   * @param {import("./navigation.js").Navigation} navigation
   */
  constructor(element, store, navigation) {
    this.#element = element;
    this.#store = store;
    this.#navigation = navigation;
    element.style.height = `${drawing.HEIGHT}px`;
    element.append(this.#cells, this.#cursor);
    store.subscribe((changed) => {
      if (changed.has("timeline") || changed.has("session")) this.#drawCells();
      if (["target", "session", "range"].some((fact) => changed.has(/** @type {"target"} */ (fact)))) this.#drawCursor();
      if (changed.has("target") || changed.has("timeline") || changed.has("session")) this.#describe();
    });
    new ResizeObserver(() => this.#drawAll()).observe(element);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.#drawAll());
    this.#listen();
  }

  get #axis() {
    return new FrameAxis(this.#element.clientWidth, this.#store.facts.session?.n_frames ?? 1);
  }

  #listen() {
    const element = this.#element;
    element.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      element.setPointerCapture(event.pointerId);
      const frame = this.#axis.frameUnder(event, element);
      this.#marked = event.shiftKey ? frame : null;
      if (event.shiftKey) {
        this.#store.set({ range: null });
        return;
      }
      this.#navigation.pause();
      this.#navigation.goTo(frame);
    });
    element.addEventListener("pointermove", (event) => {
      const frame = this.#axis.frameUnder(event, element);
      if (element.hasPointerCapture(event.pointerId)) this.#dragTo(frame);
      if (frame === this.#hovered) return;
      this.#hovered = frame;
      element.title = this.#describeFrame(frame);
      requestAnimationFrame(() => this.#drawCursor());
    });
    element.addEventListener("pointerleave", () => {
      this.#hovered = null;
      requestAnimationFrame(() => this.#drawCursor());
    });
    element.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: -1, ArrowRight: 1, PageDown: -10, PageUp: 10 }[event.key];
      if (step === undefined) return;
      event.preventDefault();
      this.#navigation.step(step);
    });
  }

  /** @param {number} frame */
  #dragTo(frame) {
    if (this.#marked === null) this.#navigation.goTo(frame);
    else if (frame !== this.#marked || this.#store.facts.range) {
      this.#store.set({ range: { first: Math.min(frame, this.#marked), last: Math.max(frame, this.#marked) } });
    }
  }

  #drawAll() {
    this.#drawCells();
    this.#drawCursor();
  }

  #drawCells() {
    const { clientWidth, clientHeight } = this.#element;
    const context = prepare(this.#cells, clientWidth, clientHeight, true);
    const { timeline, session } = this.#store.facts;
    if (!session) return;
    const style = getComputedStyle(this.#element);
    const axis = this.#axis;
    drawing.drawLabels(context, axis, style);
    drawing.drawSources(context, axis, timeline, style);
    drawing.drawKeyframes(context, axis, drawing.keyframesOf(timeline));
    drawing.drawStatuses(context, axis, timeline, style);
    drawing.drawCosts(context, axis, timeline, style);
  }

  #drawCursor() {
    const { clientWidth, clientHeight } = this.#element;
    const context = prepare(this.#cursor, clientWidth, clientHeight, true);
    const { session, target, range } = this.#store.facts;
    if (!session) return;
    const style = getComputedStyle(this.#element);
    const axis = this.#axis;
    if (range) drawing.drawRange(context, axis, range, style);
    if (this.#hovered !== null) {
      context.fillStyle = style.getPropertyValue("--muted");
      context.globalAlpha = 0.5;
      context.fillRect(axis.middle(this.#hovered) - 0.5, 0, 1, clientHeight);
      context.globalAlpha = 1;
    }
    const width = Math.max(2, axis.pitch);
    const [top, bottom] = [drawing.CELL.top - 2, drawing.CELL.bottom + 2];
    context.fillStyle = context.strokeStyle = style.getPropertyValue("--text");
    context.fillRect(axis.middle(target) - 0.5, 2, 1, top - 2);
    context.lineWidth = 2;
    context.strokeRect(axis.middle(target) - width / 2, top, width, bottom - top);
  }

  /** @param {number} frame */
  #describeFrame(frame) {
    const cell = this.#store.facts.timeline.get(frame);
    if (!cell) return `Frame ${frame}: no pose`;
    const { source, keyframe, status, remark, cost_px } = cell;
    const parts = [source, keyframe && "keyframe", status, px(cost_px)].filter(Boolean).join(", ");
    return `Frame ${frame}: ${parts}${remark && `\n${remark}`}`;
  }

  #describe() {
    const { target, session } = this.#store.facts;
    this.#element.setAttribute("aria-valuemax", String((session?.n_frames ?? 1) - 1));
    this.#element.setAttribute("aria-valuenow", String(target));
    this.#element.setAttribute("aria-valuetext", this.#describeFrame(target));
  }
}
