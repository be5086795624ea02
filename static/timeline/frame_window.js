/** Visible part of the recording in timeline and curves: zoomed about a position, panned, and following the current frame. */

/**
 * @typedef {import("../widgets/frame_axis.js").FrameAxis} FrameAxis
 * @typedef {import("../widgets/frame_axis.js").Span} Span
 */

/** Number of frames at maximum zoom. */
const LEAST = 12;
const STEP = 1.6;
/** Zoom per pixel of the wheel. */
const PER_PIXEL = 0.002;
/** Pixels per line, for wheels that count lines. */
const LINE_PX = 24;
/** Position of a frame after a page turn, as a fraction of the width. */
const LEAD = 0.1;

export class FrameWindow {
  #store;

  /** @param {import("../model/store.js").Store} store */
  constructor(store) {
    this.#store = store;
    store.on(["session"], () => this.#keepWithin());
    store.on(["target"], () => this.#follow());
  }

  /** The visible part, also if that is everything. */
  get span() {
    return this.#store.facts.visible ?? { start: 0, end: this.#frames };
  }

  get #frames() {
    return this.#store.facts.session?.n_frames ?? 1;
  }

  /**
   * Zoom about a position.
   *
   * @param {number} factor above 1 to zoom in
   * @param {number} place position in fractional frames
   */
  zoom(factor, place) {
    const { start, end } = this.span;
    const length = Math.max(LEAST, (end - start) / factor);
    const share = (place - start) / (end - start);
    this.#show(place - share * length, length);
  }

  /** Zoom in about the current frame. */
  zoomIn() {
    this.zoom(STEP, this.#store.facts.target + 0.5);
  }

  zoomOut() {
    this.zoom(1 / STEP, this.#store.facts.target + 0.5);
  }

  /** Show the marked range, or everything if it is shown already or no range is marked. */
  fit() {
    const { range } = this.#store.facts;
    if (!range) return this.#show(0, this.#frames);
    const margin = Math.max(1, 0.05 * (range.last - range.first));
    const start = Math.max(0, range.first - margin);
    const length = Math.max(LEAST, range.last + 1 + margin - start);
    const { start: at, end } = this.span;
    if (Math.abs(at - start) < 0.5 && Math.abs(end - at - length) < 1.5) this.#show(0, this.#frames);
    else this.#show(start, length);
  }

  /** @param {number} frames negative to move left */
  move(frames) {
    const { start, end } = this.span;
    this.#show(start + frames, end - start);
  }

  /** @param {number} place new centre in fractional frames */
  centre(place) {
    const { start, end } = this.span;
    this.#show(place - (end - start) / 2, end - start);
  }

  /**
   * @param {number} start
   * @param {number} length
   */
  #show(start, length) {
    const frames = this.#frames;
    if (length >= frames) {
      if (this.#store.facts.visible) this.#store.set({ visible: null });
      return;
    }
    const from = Math.max(0, Math.min(frames - length, start));
    this.#store.set({ visible: { start: from, end: from + length } });
  }

  #keepWithin() {
    const { visible } = this.#store.facts;
    if (visible) this.#show(visible.start, visible.end - visible.start);
  }

  /** Turn the page when the current frame leaves the visible part. */
  #follow() {
    const { visible, target } = this.#store.facts;
    if (!visible || (target >= visible.start && target + 1 <= visible.end)) return;
    const length = visible.end - visible.start;
    this.#show(target < visible.start ? target - (1 - LEAD) * length : target - LEAD * length, length);
  }
}

/**
 * Zoom with Ctrl+wheel, which is also how browsers report a pinch, and pan with the wheel.
 *
 * @param {HTMLElement} element
 * @param {FrameWindow} view
 * @param {() => FrameAxis} axisOf
 */
export function zoomByWheel(element, view, axisOf) {
  element.addEventListener(
    "wheel",
    (event) => {
      const axis = axisOf();
      const unit = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? LINE_PX : 1;
      event.preventDefault();
      if (event.ctrlKey || event.metaKey) {
        const x = Math.max(axis.left, Math.min(axis.right, event.clientX - element.getBoundingClientRect().left));
        view.zoom(Math.exp(-event.deltaY * unit * PER_PIXEL), axis.placeAt(x));
      } else {
        view.move(((event.deltaX + event.deltaY) * unit) / axis.pitch);
      }
    },
    { passive: false },
  );
}
