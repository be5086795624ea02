/** Where frames lie along the width of the page: one axis for the timeline and all curves. */

/** Room for labels on the left, CSS pixels. */
export const GUTTER = 52;
const PADDING = 8;

export class FrameAxis {
  /**
   * @param {number} width of the element, CSS pixels
   * @param {number} frames how many there are
   */
  constructor(width, frames) {
    this.frames = frames;
    this.left = GUTTER;
    this.right = Math.max(GUTTER + 1, width - PADDING);
    /** Width of a frame, CSS pixels; below 1 where several share a pixel. */
    this.pitch = (this.right - this.left) / frames;
  }

  /**
   * Left edge of a frame.
   *
   * @param {number} frame
   */
  start(frame) {
    return this.left + frame * this.pitch;
  }

  /**
   * Middle of a frame.
   *
   * @param {number} frame
   */
  middle(frame) {
    return this.left + (frame + 0.5) * this.pitch;
  }

  /**
   * The frame at a place, the nearest end outside.
   *
   * @param {number} x
   */
  frameAt(x) {
    return Math.max(0, Math.min(this.frames - 1, Math.floor((x - this.left) / this.pitch)));
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
    return Array.from({ length: Math.ceil(this.frames / step) }, (_, i) => i * step);
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
