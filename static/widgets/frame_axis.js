/** Horizontal axis of frames, shared by the timeline and all curves. */

/** Width of the labels on the left, CSS pixels. */
const GUTTER = 52;
const PADDING = 8;

/** @typedef {{start: number, end: number}} Span part of the recording in fractional frames, `end` not included */

export class FrameAxis {
  /**
   * @param {number} width of the element, CSS pixels
   * @param {number} frames number of frames of the recording
   * @param {Span | null} visible the visible part; null for all of it
   */
  constructor(width, frames, visible) {
    this.frames = frames;
    this.left = GUTTER;
    this.right = Math.max(GUTTER + 1, width - PADDING);
    const { start, end } = visible ?? { start: 0, end: frames };
    /** Left end of the axis, in fractional frames. */
    this.origin = start;
    /** Width of a frame, CSS pixels; below 1 where several frames share a pixel. */
    this.pitch = (this.right - this.left) / (end - start);
    /** First and last frame that is at least partly visible. */
    this.first = Math.max(0, Math.floor(start));
    this.last = Math.min(frames, Math.ceil(end)) - 1;
  }

  /**
   * Left edge of a frame, CSS pixels.
   *
   * @param {number} frame
   */
  start(frame) {
    return this.left + (frame - this.origin) * this.pitch;
  }

  /**
   * Centre of a frame, CSS pixels.
   *
   * @param {number} frame
   */
  middle(frame) {
    return this.left + (frame + 0.5 - this.origin) * this.pitch;
  }

  /**
   * Whether a frame is visible.
   *
   * @param {number} frame
   */
  shows(frame) {
    return frame >= this.first && frame <= this.last;
  }

  /**
   * Frame at a position, clamped to the recording.
   *
   * @param {number} x
   */
  frameAt(x) {
    return Math.max(0, Math.min(this.frames - 1, Math.floor(this.placeAt(x))));
  }

  /**
   * Position on the axis, in fractional frames.
   *
   * @param {number} x
   */
  placeAt(x) {
    return this.origin + (x - this.left) / this.pitch;
  }

  /**
   * Frame under the pointer.
   *
   * @param {MouseEvent} event
   * @param {HTMLElement} element the element that has this axis
   */
  frameUnder(event, element) {
    return this.frameAt(event.clientX - element.getBoundingClientRect().left);
  }

  /**
   * Round frame numbers for tick labels.
   *
   * @param {number} gap minimum distance of two ticks, CSS pixels
   */
  ticks(gap) {
    const step = roundUp(Math.max(1, gap / this.pitch));
    const begin = Math.ceil(this.first / step);
    return Array.from({ length: Math.max(0, Math.floor(this.last / step) - begin + 1) }, (_, i) => (begin + i) * step);
  }
}

/**
 * Round up to 1, 2, 5, 10, 20, 50 …
 *
 * @param {number} value greater than 0
 */
export function roundUp(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return power * ([1, 2, 5].find((digit) => digit * power >= value - 1e-9 * power) ?? 10);
}
