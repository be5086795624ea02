/** Lines of the curves of a plot: four colours, each solid and dashed. */

import { make } from "./elements.js";

const COLORS = 4;
/** Dashes of the curves after the first four. */
const SECOND_DASH = [6, 3];

/**
 * CSS variable with the colour of a curve.
 *
 * @param {number} index
 */
export function colorName(index) {
  return `--series-${index % COLORS}`;
}

/** @param {number} index */
export function dashOf(index) {
  return index % (2 * COLORS) < COLORS ? [] : SECOND_DASH;
}

/**
 * Sample of a line for a legend.
 *
 * @param {number} index
 */
export function lineSwatch(index) {
  const swatch = make("i");
  const color = `var(${colorName(index)})`;
  const [dash, gap] = dashOf(index);
  swatch.style.background = dash
    ? `repeating-linear-gradient(to right, ${color} 0 ${dash}px, transparent ${dash}px ${dash + gap}px)`
    : color;
  return swatch;
}
