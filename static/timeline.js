/** One cell per frame, coloured by who set it, with the cost above it; a click or a drag goes there. */

import { prepare } from "./drawing.js";
import { px } from "./text.js";

const CELL_HEIGHT = 12;
const MARK_HEIGHT = 8;
const PADDING = 8;

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

  /**
   * @param {HTMLElement} element
   * @param {import("./store.js").Store} store
   * @param {import("./navigation.js").Navigation} navigation
   */
  constructor(element, store, navigation) {
    this.#element = element;
    this.#store = store;
    this.#navigation = navigation;
    element.append(this.#cells, this.#cursor);
    store.subscribe((changed) => {
      if (changed.has("timeline") || changed.has("session")) this.#drawCells();
      if (changed.has("target") || changed.has("session") || changed.has("shown")) this.#drawCursor();
      if (changed.has("target") || changed.has("timeline") || changed.has("session")) this.#describe();
    });
    new ResizeObserver(() => this.#drawAll()).observe(element);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.#drawAll());
    this.#listen();
  }

  get #frames() {
    return this.#store.facts.session?.n_frames ?? 1;
  }

  /** Width of a cell, CSS pixels. */
  get #pitch() {
    return (this.#element.clientWidth - 2 * PADDING) / this.#frames;
  }

  #listen() {
    const element = this.#element;
    element.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      element.setPointerCapture(event.pointerId);
      this.#navigation.pause();
      this.#navigation.goTo(this.#frameAt(event));
    });
    element.addEventListener("pointermove", (event) => {
      const frame = this.#frameAt(event);
      if (element.hasPointerCapture(event.pointerId)) this.#navigation.goTo(frame);
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

  /** @param {PointerEvent} event */
  #frameAt(event) {
    const x = event.clientX - this.#element.getBoundingClientRect().left - PADDING;
    return Math.max(0, Math.min(this.#frames - 1, Math.floor(x / this.#pitch)));
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
    const top = clientHeight - CELL_HEIGHT - PADDING;
    const pitch = this.#pitch;
    context.fillStyle = style.getPropertyValue("--track");
    context.fillRect(PADDING, top, clientWidth - 2 * PADDING, CELL_HEIGHT);
    const gap = pitch >= 5 ? 1 : 0;
    for (const [frame, { source, keyframe }] of timeline) {
      const x = PADDING + frame * pitch;
      const width = Math.max(1, pitch - gap);
      context.fillStyle = style.getPropertyValue(`--source-${source}`) || style.getPropertyValue("--muted");
      context.fillRect(x, top, width, CELL_HEIGHT);
      if (keyframe) drawKeyframe(context, x + width / 2, top + CELL_HEIGHT / 2);
    }
    this.#drawCosts(context, style.getPropertyValue("--text"), MARK_HEIGHT, top - 4);
  }

  /**
   * The cost curve, from 0 at the bottom to the 98th percentile at the top: one lost frame must not flatten the rest.
   *
   * @param {CanvasRenderingContext2D} context
   * @param {string} color
   * @param {number} top
   * @param {number} bottom
   */
  #drawCosts(context, color, top, bottom) {
    const costs = [...this.#store.facts.timeline]
      .flatMap(([frame, { cost_px }]) => (cost_px === null ? [] : [{ frame, cost_px }]))
      .sort((a, b) => a.frame - b.frame);
    if (costs.length === 0) return;
    const ordered = costs.map(({ cost_px }) => cost_px).sort((a, b) => a - b);
    const most = Math.max(1e-6, ordered[Math.floor(0.98 * (ordered.length - 1))]);
    context.beginPath();
    let former = -2;
    for (const { frame, cost_px } of costs) {
      const x = PADDING + (frame + 0.5) * this.#pitch;
      const y = bottom - (bottom - top) * Math.min(1, cost_px / most);
      if (frame === former + 1) context.lineTo(x, y);
      else context.moveTo(x - 0.5, y);
      // A frame that stands alone shows as a dot.
      context.lineTo(x + 0.5, y);
      former = frame;
    }
    context.strokeStyle = color;
    context.globalAlpha = 0.75;
    context.lineWidth = 1.25;
    context.lineJoin = "round";
    context.stroke();
    context.globalAlpha = 1;
  }

  #drawCursor() {
    const { clientWidth, clientHeight } = this.#element;
    const context = prepare(this.#cursor, clientWidth, clientHeight, true);
    const { session, target } = this.#store.facts;
    if (!session) return;
    const style = getComputedStyle(this.#element);
    const pitch = this.#pitch;
    const width = Math.max(2, pitch);
    const height = CELL_HEIGHT + 6;
    const top = clientHeight - CELL_HEIGHT - PADDING - 3;
    if (this.#hovered !== null) {
      context.fillStyle = style.getPropertyValue("--muted");
      context.globalAlpha = 0.5;
      context.fillRect(PADDING + (this.#hovered + 0.5) * pitch - 0.5, 0, 1, clientHeight);
      context.globalAlpha = 1;
    }
    const middle = PADDING + (target + 0.5) * pitch;
    context.fillStyle = context.strokeStyle = style.getPropertyValue("--text");
    context.fillRect(middle - 0.5, 2, 1, top - 2);
    context.lineWidth = 2;
    context.strokeRect(middle - width / 2, top + 1, width, height - 2);
  }

  /** @param {number} frame */
  #describeFrame(frame) {
    const cell = this.#store.facts.timeline.get(frame);
    if (!cell) return `Frame ${frame}: no pose`;
    return `Frame ${frame}: ${cell.source}${cell.keyframe ? ", keyframe" : ""}, ${px(cell.cost_px)}`;
  }

  #describe() {
    const { target } = this.#store.facts;
    this.#element.setAttribute("aria-valuemax", String(this.#frames - 1));
    this.#element.setAttribute("aria-valuenow", String(target));
    this.#element.setAttribute("aria-valuetext", this.#describeFrame(target));
  }
}

/**
 * A diamond on the cell.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {number} x
 * @param {number} y
 */
function drawKeyframe(context, x, y) {
  context.beginPath();
  context.moveTo(x, y - 4);
  context.lineTo(x + 4, y);
  context.lineTo(x, y + 4);
  context.lineTo(x - 4, y);
  context.closePath();
  context.fillStyle = "#fff";
  context.strokeStyle = "rgba(0, 0, 0, 0.7)";
  context.lineWidth = 1;
  context.fill();
  context.stroke();
}
