/** Where frames lie along the width of the page: one axis for the timeline and all curves. */

/** Room for labels on the left, CSS pixels. */
export const GUTTER = 52;
const PADDING = 8;

/** @typedef {{start: number, end: number}} Span a part of the recording, in frames and their parts, `end` not included */

export class FrameAxis {
  /**
   * @param {number} width of the element, CSS pixels
   * @param {number} frames how many there are
   * @param {Span | null} visible the part that is shown; null for all of it
   */
  constructor(width, frames, visible) {
    this.frames = frames;
    this.left = GUTTER;
    this.right = Math.max(GUTTER + 1, width - PADDING);
    const { start, end } = visible ?? { start: 0, end: frames };
    /** Where the axis begins, in frames. */
    this.origin = start;
    /** Width of a frame, CSS pixels; below 1 where several share a pixel. */
    this.pitch = (this.right - this.left) / (end - start);
    /** First and last frame of which something shows. */
    this.first = Math.max(0, Math.floor(start));
    this.last = Math.min(frames, Math.ceil(end)) - 1;
  }

  /**
   * Left edge of a frame.
   *
   * @param {number} frame
   */
  start(frame) {
    return this.left + (frame - this.origin) * this.pitch;
  }

  /**
   * Middle of a frame.
   *
   * @param {number} frame
   */
  middle(frame) {
    return this.left + (frame + 0.5 - this.origin) * this.pitch;
  }

  /**
   * Whether a frame lies within what is shown.
   *
   * @param {number} frame
   */
  shows(frame) {
    return frame >= this.first && frame <= this.last;
  }

  /**
   * The frame at a place, the nearest end outside.
   *
   * @param {number} x
   */
  frameAt(x) {
    return Math.max(0, Math.min(this.frames - 1, Math.floor(this.placeAt(x))));
  }

  /**
   * The place on the axis, in frames and their parts.
   *
   * @param {number} x
   */
  placeAt(x) {
    return this.origin + (x - this.left) / this.pitch;
  }

  /**
   * The frame under a pointer.
   *
   * @param {MouseEvent} event
   * @param {HTMLElement} element that has this axis
   */
  frameUnder(event, element) {
    return this.frameAt(event.clientX - element.getBoundingClientRect().left);
  }

  /**
   * Frames to put numbers at: round ones, far enough from each other.
   *
   * @param {number} gap least distance of two, CSS pixels
   */
  ticks(gap) {
    const step = roundUp(Math.max(1, gap / this.pitch));
    const begin = Math.ceil(this.first / step);
    return Array.from({ length: Math.max(0, Math.floor(this.last / step) - begin + 1) }, (_, i) => (begin + i) * step);
  }
}

/**
 * The next of 1, 2, 5, 10, 20, 50 …
 *
 * @param {number} value above 0
 */
export function roundUp(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return power * ([1, 2, 5].find((digit) => digit * power >= value - 1e-9 * power) ?? 10);
}
