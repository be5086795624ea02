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

/** @typedef {ReturnType<typeof makeFrameWindow>} FrameWindow */

/** @param {import("../model/store.js").Store} store */
export function makeFrameWindow(store) {
  store.on(["session"], keepWithin);
  store.on(["target"], follow);

  /** The visible part, also if that is everything. */
  const span = () => store.facts.visible ?? { start: 0, end: frames() };
  const frames = () => store.facts.session?.n_frames ?? 1;

  /**
   * Zoom about a position.
   *
   * @param {number} factor above 1 to zoom in
   * @param {number} place position in fractional frames
   */
  function zoom(factor, place) {
    const { start, end } = span();
    const length = Math.max(LEAST, (end - start) / factor);
    const share = (place - start) / (end - start);
    show(place - share * length, length);
  }

  /** Zoom in about the current frame. */
  const zoomIn = () => zoom(STEP, store.facts.target + 0.5);
  const zoomOut = () => zoom(1 / STEP, store.facts.target + 0.5);

  /** Show the marked range, or everything if it is shown already or no range is marked. */
  function fit() {
    const { range } = store.facts;
    if (!range) return show(0, frames());
    const margin = Math.max(1, 0.05 * (range.last - range.first));
    const start = Math.max(0, range.first - margin);
    const length = Math.max(LEAST, range.last + 1 + margin - start);
    const { start: at, end } = span();
    if (Math.abs(at - start) < 0.5 && Math.abs(end - at - length) < 1.5) show(0, frames());
    else show(start, length);
  }

  /** @param {number} frames negative to move left */
  function move(frames) {
    const { start, end } = span();
    show(start + frames, end - start);
  }

  /** @param {number} place new centre in fractional frames */
  function centre(place) {
    const { start, end } = span();
    show(place - (end - start) / 2, end - start);
  }

  /**
   * @param {number} start
   * @param {number} length
   */
  function show(start, length) {
    if (length >= frames()) {
      if (store.facts.visible) store.set({ visible: null });
      return;
    }
    const from = Math.max(0, Math.min(frames() - length, start));
    store.set({ visible: { start: from, end: from + length } });
  }

  function keepWithin() {
    const { visible } = store.facts;
    if (visible) show(visible.start, visible.end - visible.start);
  }

  /** Turn the page when the current frame leaves the visible part. */
  function follow() {
    const { visible, target } = store.facts;
    if (!visible || (target >= visible.start && target + 1 <= visible.end)) return;
    const length = visible.end - visible.start;
    show(target < visible.start ? target - (1 - LEAD) * length : target - LEAD * length, length);
  }

  return { zoom, zoomIn, zoomOut, fit, move, centre };
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
