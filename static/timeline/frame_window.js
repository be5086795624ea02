/** Which part of the recording timeline and curves show: zoomed about a place, moved along, and following the frame. */

/**
 * @typedef {import("../widgets/frame_axis.js").FrameAxis} FrameAxis
 * @typedef {import("../widgets/frame_axis.js").Span} Span
 */

/** Frames that the closest zoom shows. */
const LEAST = 12;
const STEP = 1.6;
/** Change of the zoom by one pixel of the wheel. */
const PER_PIXEL = 0.002;
/** Pixels of a line, for wheels that count lines. */
const LINE_PX = 24;
/** Where a frame that left the view comes back to, as a share of its width. */
const LEAD = 0.1;

export class FrameWindow {
  #store;

  /** @param {import("../model/store.js").Store} store */
  constructor(store) {
    this.#store = store;
    store.subscribe((changed) => {
      if (changed.has("session")) this.#keepWithin();
      if (changed.has("target")) this.#follow();
    });
  }

  /** What is shown, also where that is everything. */
  get span() {
    return this.#store.facts.visible ?? { start: 0, end: this.#frames };
  }

  get #frames() {
    return this.#store.facts.session?.n_frames ?? 1;
  }

  /**
   * Show more or less of the recording; a place stays where it is.
   *
   * @param {number} factor above 1 to see fewer frames
   * @param {number} place in frames
   */
  zoom(factor, place) {
    const { start, end } = this.span;
    const length = Math.max(LEAST, (end - start) / factor);
    const share = (place - start) / (end - start);
    this.#show(place - share * length, length);
  }

  /** See fewer frames around the one that is shown. */
  zoomIn() {
    this.zoom(STEP, this.#store.facts.target + 0.5);
  }

  zoomOut() {
    this.zoom(1 / STEP, this.#store.facts.target + 0.5);
  }

  /** Show the marked range, or all where it is shown or none is marked. */
  fit() {
    const { range } = this.#store.facts;
    if (!range) return this.#show(0, this.#frames);
    const margin = Math.max(1, 0.05 * (range.last - range.first));
    const start = Math.max(0, range.first - margin);
    const length = Math.max(LEAST, range.last + 1 + margin - start);
    const { start: at, end } = this.span;
    const isShown = Math.abs(at - start) < 0.5 && Math.abs(end - at - length) < 1.5;
    if (isShown) this.#show(0, this.#frames);
    else this.#show(start, length);
  }

  /** @param {number} frames to the right, or to the left where negative */
  move(frames) {
    const { start, end } = this.span;
    this.#show(start + frames, end - start);
  }

  /** @param {number} place in frames, to be in the middle */
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

  /** Turn the page when the frame leaves the view. */
  #follow() {
    const { visible, target } = this.#store.facts;
    if (!visible || (target >= visible.start && target + 1 <= visible.end)) return;
    const length = visible.end - visible.start;
    this.#show(target < visible.start ? target - (1 - LEAD) * length : target - LEAD * length, length);
  }
}

/**
 * Let the wheel zoom with Ctrl (which is also how a touchpad's pinch arrives), and move what is zoomed without.
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
