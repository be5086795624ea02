/** Data of curves: one number per frame, NaN where there is none. */

/** @typedef {import("./protocol.js").CurveGroup | "search" | "landscape" | "doubts" | "runs"} Tab */

/**
 * @typedef {import("./protocol.js").CurvesHeader} CurvesHeader
 * @typedef {{plot: number, label: string, dof: number | null, values: Float32Array}} Series dof: null for costs
 * @typedef {{group: import("./protocol.js").CurveGroup, person: number, plots: import("./protocol.js").Plot[],
 *   series: Series[], raw: Float32Array[]}} Curves `values` are drawn; `raw` has angles within one turn, as received
 */

/**
 * Merge a message: a new group of curves, or some frames of the current group.
 *
 * @param {Curves | null} previous
 * @param {CurvesHeader} header
 * @param {ArrayBuffer} payload frames as uint32, then each curve as float32
 * @param {number} frameCount of the recording
 * @returns {Curves}
 */
export function mergeCurves(previous, { group, person, replace, count, plots }, payload, frameCount) {
  const labels = plots.flatMap(({ labels, unit, dofs }, plot) => labels.map((label, i) => ({ plot, label, unit, dof: dofs[i] ?? null })));
  const frames = new Uint32Array(payload, 0, count);
  const goesOn = !replace && previous?.group === group && previous.person === person && previous.raw.length === labels.length;
  const raw = goesOn ? previous.raw : labels.map(() => new Float32Array(frameCount).fill(NaN));
  raw.forEach((values, index) => {
    const news = new Float32Array(payload, 4 * count * (index + 1), count);
    for (let i = 0; i < count; i += 1) values[frames[i]] = news[i];
  });
  const series = labels.map(({ unit, ...curve }, index) => ({ ...curve, values: unit === "deg" ? unwrapped(raw[index]) : raw[index] }));
  return { group, person, plots, series, raw };
}

/**
 * Unwrap angles in degrees.
 *
 * @param {Float32Array} degrees
 */
function unwrapped(degrees) {
  const out = new Float32Array(degrees.length).fill(NaN);
  let turns = 0;
  let previous = NaN;
  for (let i = 0; i < degrees.length; i += 1) {
    const value = degrees[i];
    if (value !== value) continue;
    if (previous === previous) turns -= Math.round((value - previous) / 360);
    previous = value;
    out[i] = value + 360 * turns;
  }
  return out;
}

/**
 * Minimum and maximum of some curves; null if they have no number.
 *
 * @param {Float32Array[]} curves
 */
export function extent(curves) {
  let min = Infinity;
  let max = -Infinity;
  for (const values of curves) {
    for (let i = 0; i < values.length; i += 1) {
      if (values[i] < min) min = values[i];
      if (values[i] > max) max = values[i];
    }
  }
  return min <= max ? { min, max } : null;
}

/**
 * Trace a curve. Of several frames that share a pixel, trace the first, minimum, maximum and last value. Spikes remain
 * visible, and the time is bounded by the width of the plot. Missing values leave gaps, and an isolated frame is a dot.
 *
 * @param {Path2D} path
 * @param {Float32Array} values
 * @param {import("../widgets/frame_axis.js").FrameAxis} axis
 * @param {(value: number) => number} toY
 */
export function trace(path, values, axis, toY) {
  const stride = Math.max(1, Math.floor(1 / axis.pitch));
  let isOpen = false;
  // One stride more on each side, so that lines extend beyond the edge.
  const begin = Math.max(0, Math.floor(axis.first / stride) - 1) * stride;
  const end = Math.min(values.length, axis.last + 2 * stride + 1);
  for (let first = begin; first < end; first += stride) {
    const points = summary(values, first, Math.min(first + stride, values.length));
    if (points.length === 0) {
      isOpen = false;
      continue;
    }
    const x = axis.middle(first + (stride - 1) / 2);
    if (!isOpen) path.moveTo(x - 0.5, toY(points[0]));
    for (const value of points) path.lineTo(x, toY(value));
    if (!isOpen) path.lineTo(x + 0.5, toY(points[points.length - 1]));
    isOpen = true;
  }
}

/**
 * First, minimum, maximum and last number of an interval; empty if it has none.
 *
 * @param {Float32Array} values
 * @param {number} from
 * @param {number} to
 */
function summary(values, from, to) {
  if (to - from === 1) return values[from] === values[from] ? [values[from]] : [];
  let [first, last, min, max] = [NaN, NaN, Infinity, -Infinity];
  for (let i = from; i < to; i += 1) {
    const value = values[i];
    if (value !== value) continue;
    if (first !== first) first = value;
    last = value;
    if (value < min) min = value;
    if (value > max) max = value;
  }
  return first === first ? [first, min, max, last] : [];
}
