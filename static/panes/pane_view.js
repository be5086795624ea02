/**
 * Zoom and centre of an image in its pane. The centre is an image position, so that it stays when the pane is resized. A
 * box that was framed is framed again, until the view is moved.
 *
 * Image positions are undistorted pixels with pixel centres at integers, so an image spans -0.5 to width - 0.5. Screen
 * positions are CSS pixels from the upper left corner of the pane.
 */

const MIN_ZOOM = 0.25;
const MAX_ZOOM = 40;
/** Size of what is framed with its margin, in sizes of its box: joints lie within the body. */
const FRAME_MARGIN = 1.4;
const MAX_FRAME_ZOOM = 8;
/** A framed box that moves keeps its zoom while it takes this share of the pane: less is small, more cuts
 * off heads and feet, which reach beyond the joints. */
const [MIN_FRAMED, MAX_FRAMED] = [0.5, 0.8];

/** @typedef {{left: number, top: number, right: number, bottom: number}} ImageBox image positions */

export class PaneView {
  /** 1 if the whole image fits the pane. */
  zoom = 1;
  #image;
  #pane = { width: 1, height: 1 };
  #center;
  /** @type {ImageBox | null} what the pane is filled with */
  #framed = null;
  /** @type {{u: number, v: number} | null} the followed centre, if it lies outside the image */
  #beyond = null;

  /**
   * @param {number} width of the image, px
   * @param {number} height of the image, px
   */
  constructor(width, height) {
    this.#image = { width, height };
    this.#center = this.#middle();
  }

  #middle() {
    return { u: (this.#image.width - 1) / 2, v: (this.#image.height - 1) / 2 };
  }

  /** CSS pixels per image pixel. */
  get scale() {
    const { width, height } = this.#image;
    return this.zoom * Math.min(this.#pane.width / width, this.#pane.height / height);
  }

  /** Screen position of image position (0, 0). */
  get origin() {
    return {
      x: this.#pane.width / 2 - this.#center.u * this.scale,
      y: this.#pane.height / 2 - this.#center.v * this.scale,
    };
  }

  /** Box of the whole image on the screen, CSS pixels. */
  get place() {
    const { x, y } = this.toScreen(-0.5, -0.5);
    return { x, y, width: this.#image.width * this.scale, height: this.#image.height * this.scale };
  }

  /** Image position in the middle of the pane. */
  get center() {
    return { ...this.#center };
  }

  /**
   * Whether the pane shows some part of a box.
   *
   * @param {ImageBox} box
   */
  shows({ left, top, right, bottom }) {
    const [first, last] = [this.toScreen(left, top), this.toScreen(right, bottom)];
    return last.x > 0 && last.y > 0 && first.x < this.#pane.width && first.y < this.#pane.height;
  }

  /** The part of the image that the view shows, to be restored; null for all of it. */
  get choice() {
    if (this.#framed) return { framed: this.#framed };
    return this.isReset ? null : { zoom: this.zoom, ...this.#center };
  }

  /**
   * Restore a choice. Anything else shows the whole image.
   *
   * @param {unknown} choice
   */
  restore(choice) {
    this.reset();
    if (typeof choice !== "object" || !choice) return;
    const { framed, zoom, u, v } = /** @type {Record<string, any>} */ (choice);
    if (framed && [framed.left, framed.top, framed.right, framed.bottom].every(Number.isFinite)) return this.frame(framed);
    if (!Number.isFinite(zoom) || !Number.isFinite(u) || !Number.isFinite(v)) return;
    this.zoom = Math.max(MIN_ZOOM, Math.min(MAX_ZOOM, Number(zoom)));
    this.#moveCenter(Number(u) - this.#center.u, Number(v) - this.#center.v);
  }

  /** Whether the view is filled with a box. */
  get isFramed() {
    return this.#framed !== null;
  }

  get isReset() {
    const { u, v } = this.#middle();
    return this.zoom === 1 && this.#center.u === u && this.#center.v === v;
  }

  /**
   * @param {number} width
   * @param {number} height
   */
  resize(width, height) {
    this.#pane = { width: Math.max(1, width), height: Math.max(1, height) };
    if (this.#framed) this.frame(this.#framed);
  }

  /**
   * @param {number} u
   * @param {number} v
   */
  toScreen(u, v) {
    const { x, y } = this.origin;
    return { x: x + u * this.scale, y: y + v * this.scale };
  }

  /**
   * @param {number} x
   * @param {number} y
   */
  toImage(x, y) {
    const origin = this.origin;
    return { u: (x - origin.x) / this.scale, v: (y - origin.y) / this.scale };
  }

  /**
   * Zoom about a screen position, which keeps its image position.
   *
   * @param {number} x
   * @param {number} y
   * @param {number} factor
   */
  zoomAt(x, y, factor) {
    this.#framed = null;
    const fixed = this.toImage(x, y);
    this.zoom = Math.max(MIN_ZOOM, Math.min(MAX_ZOOM, this.zoom * factor));
    const moved = this.toImage(x, y);
    this.#moveCenter(fixed.u - moved.u, fixed.v - moved.v);
  }

  /**
   * @param {number} dx
   * @param {number} dy
   */
  panBy(dx, dy) {
    this.#framed = null;
    this.#moveCenter(-dx / this.scale, -dy / this.scale);
  }

  reset() {
    this.#framed = this.#beyond = null;
    this.zoom = 1;
    this.#center = this.#middle();
  }

  /**
   * Fill the pane with a box of the image and a margin around it.
   *
   * @param {ImageBox} box
   */
  frame(box) {
    const { left, top, right, bottom } = box;
    this.#framed = box;
    const { width, height } = this.#pane;
    const scale = Math.min(width / Math.max(1, right - left), height / Math.max(1, bottom - top)) / FRAME_MARGIN;
    this.zoom = 1;
    this.zoom = Math.max(1, Math.min(MAX_FRAME_ZOOM, scale / this.scale));
    this.#center = this.#middle();
    if (this.zoom > 1) this.#moveCenter((left + right) / 2 - this.#center.u, (top + bottom) / 2 - this.#center.v);
  }

  /**
   * Keep a framed box in the middle that has moved. The zoom stays while the box fits the pane well.
   *
   * @param {ImageBox} box
   */
  refit(box) {
    const { left, top, right, bottom } = box;
    const share = Math.max((right - left) / this.#pane.width, (bottom - top) / this.#pane.height) * this.scale;
    if (this.zoom === 1 || share < MIN_FRAMED || share > MAX_FRAMED) return this.frame(box);
    this.#framed = box;
    this.#moveCenter((left + right) / 2 - this.#center.u, (top + bottom) / 2 - this.#center.v);
  }

  /**
   * Move the centre with the people. If it would leave the image, the way back starts beyond its border.
   *
   * @param {number} du
   * @param {number} dv
   */
  follow(du, dv) {
    const { u, v } = this.#beyond ?? this.#center;
    const wanted = { u: u + du, v: v + dv };
    this.#moveCenter(wanted.u - this.#center.u, wanted.v - this.#center.v);
    if (this.#center.u !== wanted.u || this.#center.v !== wanted.v) this.#beyond = wanted;
  }

  /**
   * Show an image position in the middle.
   *
   * @param {{u: number, v: number}} center
   * @param {number} scale CSS pixels per image pixel, within the limits of zoom
   */
  look({ u, v }, scale) {
    this.#framed = null;
    this.zoom = 1;
    this.zoom = Math.max(MIN_ZOOM, Math.min(MAX_ZOOM, scale / this.scale));
    this.#moveCenter(u - this.#center.u, v - this.#center.v);
  }

  /**
   * Move the centre, which stays inside the image.
   *
   * @param {number} du
   * @param {number} dv
   */
  #moveCenter(du, dv) {
    const { width, height } = this.#image;
    this.#beyond = null;
    this.#center = {
      u: Math.max(0, Math.min(width - 1, this.#center.u + du)),
      v: Math.max(0, Math.min(height - 1, this.#center.v + dv)),
    };
  }
}
