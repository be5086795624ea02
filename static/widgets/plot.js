/** Plot with two numeric axes. Sizes are CSS pixels. */

import { drawWithin, fillRect, setText } from "./canvas.js";
import { roundUp } from "./frame_axis.js";

const LEFT = 44;
const RIGHT = 8;
const BOTTOM = 16;
const TOP = 6;
const TICK_X = 80;
const TICK_Y = 22;

/** @typedef {{min: number, max: number}} Range */

export class Plot {
  /**
   * @param {number} width
   * @param {number} height
   * @param {Range} xs
   * @param {Range} ys
   * @param {number} top space above the plot
   */
  constructor(width, height, xs, ys, top = TOP) {
    this.xs = xs;
    this.left = LEFT;
    this.right = Math.max(LEFT + 1, width - RIGHT);
    this.top = top;
    this.bottom = Math.max(top + 1, height - BOTTOM);
    /** @type {Scale} */
    this.scale = { ...ys, top, bottom: this.bottom };
  }

  /** @param {number} value */
  x(value) {
    return this.left + ((this.right - this.left) * (value - this.xs.min)) / (this.xs.max - this.xs.min);
  }

  /** @param {number} value */
  y(value) {
    return toY(this.scale, value);
  }

  /**
   * Value at a position, clamped to the range.
   *
   * @param {number} x
   */
  valueAt(x) {
    const share = Math.max(0, Math.min(1, (x - this.left) / (this.right - this.left)));
    return this.xs.min + share * (this.xs.max - this.xs.min);
  }

  /**
   * Draw the background, grid lines at round values and their labels.
   *
   * @param {CanvasRenderingContext2D} context
   * @param {CSSStyleDeclaration} style
   * @param {string} unit of x
   */
  drawFrame(context, style, unit) {
    drawValues(context, style, this, this.scale);
    setText(context, "center", "bottom");
    for (const value of ticks(this.xs, TICK_X / (this.right - this.left))) {
      const x = this.x(value);
      fillRect(context, style.getPropertyValue("--muted"), x - 0.5, this.bottom, 1, 3);
      context.fillText(`${Number(value.toPrecision(6)).toLocaleString("en")}${unit}`, Math.min(x, this.right - 14), this.bottom + BOTTOM);
    }
  }

  /**
   * Draw a line through points.
   *
   * @param {CanvasRenderingContext2D} context
   * @param {ArrayLike<number>} xs
   * @param {ArrayLike<number>} ys NaN leaves a gap
   * @param {boolean} isStepped whether a value applies until the next point
   */
  drawLine(context, xs, ys, isStepped = false) {
    const line = new Path2D();
    let isOpen = false;
    for (let i = 0; i < xs.length; i += 1) {
      if (!Number.isFinite(ys[i])) {
        isOpen = false;
        continue;
      }
      const [x, y] = [this.x(xs[i]), this.y(ys[i])];
      if (!isOpen) line.moveTo(x, y);
      else if (isStepped) line.lineTo(x, this.y(ys[i - 1]));
      if (isOpen) line.lineTo(x, y);
      isOpen = true;
    }
    context.stroke(line);
  }

  /**
   * Clip drawing to the plot.
   *
   * @param {CanvasRenderingContext2D} context
   * @param {() => void} draw
   */
  within(context, draw) {
    drawWithin(context, this, draw);
  }
}

/** @typedef {{top: number, bottom: number, min: number, max: number}} Scale values over a height, CSS pixels */

/**
 * @param {Scale} scale
 * @param {number} value
 */
export function toY({ top, bottom, min, max }, value) {
  return bottom - ((bottom - top) * (value - min)) / (max - min);
}

/**
 * Draw the background of a plot, grid lines at round values and their labels.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {CSSStyleDeclaration} style
 * @param {{left: number, right: number}} ends of the lines
 * @param {Scale} scale
 * @param {(y: number) => boolean} isLabelled
 */
export function drawValues(context, style, { left, right }, scale, isLabelled = () => true) {
  const height = scale.bottom - scale.top;
  fillRect(context, style.getPropertyValue("--plot"), left, scale.top, right - left, height);
  setText(context, "right", "middle");
  for (const value of ticks(scale, TICK_Y / height)) {
    const y = Math.round(toY(scale, value));
    fillRect(context, style.getPropertyValue("--line"), left, y, right - left, 1);
    context.fillStyle = style.getPropertyValue("--muted");
    if (isLabelled(y)) context.fillText(String(Number(value.toPrecision(6))), left - 6, y);
  }
}

/**
 * @param {Range} range
 * @param {number} share minimum distance of two ticks as a fraction of the range
 */
function ticks({ min, max }, share) {
  const step = roundUp(Math.max(1e-12, (max - min) * share));
  const first = Math.ceil(min / step - 1e-9);
  return Array.from({ length: Math.max(0, Math.floor(max / step + 1e-9) - first + 1) }, (_, i) => (first + i) * step);
}

/**
 * Find the value nearest to another one; returns its index.
 *
 * @param {ArrayLike<number>} values ascending
 * @param {number} value
 */
export function nearest(values, value) {
  return Array.from(values).reduce((best, one, index) => (Math.abs(one - value) < Math.abs(values[best] - value) ? index : best), 0);
}
