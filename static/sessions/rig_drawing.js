/** Drawings of where calibrated cameras stand and look: from above, and from the side. */

import { makeSvg } from "../widgets/elements.js";

/**
 * @typedef {number[]} Point of three coordinates, metres
 *
 * @typedef {object} Rig
 * @property {string[]} names
 * @property {Point[]} centers
 * @property {Point[]} axes unit vectors
 * @property {Point | null} point at which all look
 * @property {number[] | null} distances_m
 * @property {number[]} heights_m
 * @property {string} sentence
 * @property {string[]} doubts
 */

const [WIDTH, HEIGHT, MARGIN] = [270, 176, 24];
/** Height of the band at the top with label and scale. */
const BAND = 16;
/** Names of cameras that are nearer to each other, as drawn, stand together. */
const NEAR_PX = 24;
const PERSON_M = 1.7;
const CAMERA_PX = 13;
/** More names would cover each other. */
const MAX_NAMES = 16;
/** Two horizontal axes for each axis that points up, so that the first view is from above. @type {Record<string, [number, number][]>} */
const ACROSS = {
  "x": [[1, 1], [2, 1]], "y": [[2, 1], [0, 1]], "z": [[0, 1], [1, 1]],
  "-x": [[1, 1], [2, -1]], "-y": [[2, 1], [0, -1]], "-z": [[0, 1], [1, -1]],
}; // prettier-ignore

/**
 * Draw a rig.
 *
 * @param {SVGSVGElement} top
 * @param {SVGSVGElement} side
 * @param {Rig} rig
 * @param {string} up axis that points up
 */
export function drawRig(top, side, rig, up) {
  const [east, north] = ACROSS[up];
  const height = /** @type {[number, number]} */ (["xyz".indexOf(up.slice(-1)), up.startsWith("-") ? -1 : 1]);
  drawView(top, "From above", rig, east, north, false);
  drawView(side, "From the side", rig, east, height, true);
}

/**
 * @param {SVGSVGElement} svg
 * @param {string} label
 * @param {Rig} rig
 * @param {[number, number]} across index and sign of the axis to the right
 * @param {[number, number]} upwards the same of the axis upwards
 * @param {boolean} isSide
 */
function drawView(svg, label, rig, across, upwards, isSide) {
  const flat = (/** @type {Point} */ p) => [p[across[0]] * across[1], p[upwards[0]] * upwards[1]];
  const centers = rig.centers.map(flat);
  const shown = [...centers, ...(rig.point ? [flat(rig.point)] : [])];
  const feet = rig.point ? flat(rig.point)[0] : mean(centers.map(([x]) => x));
  if (isSide) shown.push([feet, 0], [feet, PERSON_M]);
  const [low, high] = [0, 1].map((i) => [Math.min(...shown.map((p) => p[i])), Math.max(...shown.map((p) => p[i]))]);
  const scale = Math.min((WIDTH - 2 * MARGIN) / Math.max(low[1] - low[0], 0.1), (HEIGHT - BAND - 2 * MARGIN) / Math.max(high[1] - high[0], 0.1));
  const middle = [(low[0] + low[1]) / 2, (high[0] + high[1]) / 2];
  const place = (/** @type {number[]} */ [x, y]) => [WIDTH / 2 + scale * (x - middle[0]), (HEIGHT + BAND) / 2 - scale * (y - middle[1])];

  /** @type {SVGElement[]} */
  const parts = [text(label, 6, 12, "rig-label")];
  if (isSide) {
    const [x, floor] = place([feet, 0]);
    parts.push(line([0, floor], [WIDTH, floor], "rig-floor"), line([x, floor], place([feet, PERSON_M]), "rig-person"));
  }
  if (rig.point) {
    const to = place(flat(rig.point));
    parts.push(...centers.map((from) => line(place(from), to, "rig-sight")));
    parts.push(makeSvg("circle", { cx: to[0], cy: to[1], r: 3, class: "rig-point" }));
  }
  rig.axes.forEach((axis, i) => {
    const [x, y] = place(centers[i]);
    const [dx, dy] = flat(axis);
    parts.push(camera(x, y, dx, -dy, `${rig.names[i]}: ${figures(rig, i)}`));
  });
  if (rig.names.length <= MAX_NAMES) parts.push(...names(rig.names, centers.map(place)));
  const metres = niceLength(60 / scale);
  const end = WIDTH - 34;
  parts.push(line([end - metres * scale, 10], [end, 10], "rig-scale"), text(`${metres} m`, end + 5, 13, "rig-label"));
  svg.setAttribute("viewBox", `0 0 ${WIDTH} ${HEIGHT}`);
  svg.setAttribute("aria-label", `Cameras ${label.toLowerCase()}`);
  svg.replaceChildren(...parts);
}

/**
 * Names beside the cameras; of cameras behind each other in one line.
 *
 * @param {string[]} all
 * @param {number[][]} places
 */
function names(all, places) {
  /** @type {{at: number[], words: string[]}[]} */
  const groups = [];
  all.forEach((name, i) => {
    const near = groups.find(({ at }) => Math.hypot(at[0] - places[i][0], at[1] - places[i][1]) < NEAR_PX);
    if (near) near.words.push(name);
    else groups.push({ at: places[i], words: [name] });
  });
  return groups.map(({ at: [x, y], words }) => {
    const isRight = x > WIDTH / 2;
    const name = text(words.join(", "), x + (isRight ? 6 : -6), y + (y > (HEIGHT + BAND) / 2 ? 16 : -9), "rig-name");
    if (isRight) name.setAttribute("text-anchor", "end");
    return name;
  });
}

/**
 * @param {Rig} rig
 * @param {number} i
 */
function figures(rig, i) {
  const height = `${rig.heights_m[i].toFixed(2)} m over the floor`;
  return rig.distances_m ? `${rig.distances_m[i].toFixed(2)} m from the point, ${height}` : height;
}

/**
 * A wedge that opens to where a camera looks; shorter where it looks along the line of sight.
 *
 * @param {number} x
 * @param {number} y
 * @param {number} dx
 * @param {number} dy
 * @param {string} title
 */
function camera(x, y, dx, dy, title) {
  const side = [-dy * 0.45, dx * 0.45];
  const corner = (/** @type {number} */ sign) => [x + CAMERA_PX * (dx + sign * side[0]), y + CAMERA_PX * (dy + sign * side[1])];
  const points = [[x, y], corner(1), corner(-1)].map((p) => p.map((v) => v.toFixed(1)).join(",")).join(" ");
  const parts = [makeSvg("title", {}, title), makeSvg("polygon", { points }), makeSvg("circle", { cx: x, cy: y, r: 3 })];
  return makeSvg("g", { class: "rig-camera" }, ...parts);
}

/**
 * @param {number[]} from
 * @param {number[]} to
 * @param {string} kind
 */
function line([x1, y1], [x2, y2], kind) {
  return makeSvg("line", { x1, y1, x2, y2, class: kind });
}

/**
 * @param {string} words
 * @param {number} x
 * @param {number} y
 * @param {string} kind
 */
function text(words, x, y, kind) {
  return makeSvg("text", { x, y, class: kind }, words);
}

/** @param {number[]} values */
function mean(values) {
  return values.reduce((sum, value) => sum + value, 0) / Math.max(1, values.length);
}

/**
 * The largest of 1, 2 and 5 times a power of ten that is no larger, metres.
 *
 * @param {number} most
 */
function niceLength(most) {
  const power = 10 ** Math.floor(Math.log10(Math.max(most, 1e-3)));
  return Number((power * ([5, 2, 1].find((n) => n * power <= most) ?? 1)).toPrecision(1));
}
