/** A plain 3-D view: skeletons, cameras and the floor, turned by dragging. */

import { data, poseOf } from "./data.js";
import { begin, byId, token } from "./dom.js";
import { follow, redraw, shown } from "./player.js";

/** @typedef {number[]} Vector */

/** @type {(a: Vector, b: Vector) => number} */
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
/** @type {(a: Vector, b: Vector) => Vector} */
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
/** @type {(a: Vector, s: number, b: Vector) => Vector} */
const along = (a, s, b) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
/** @type {(a: Vector) => Vector} */
const unit = (a) => along([0, 0, 0], 1 / Math.hypot(...a), a);

const FOCAL = 1.2;
/** Focal length, in heights of the view. */
const GRID_M = 0.5;
const GRID_CELLS = 8;
/** Spacing of the lines of the floor, and their number on each side of the middle. */

const up = unit(data.floor.normal);
const east = unit(cross(up, Math.abs(up[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0]));
const north = cross(up, east);

/** Middle of all points of all frames, metres, and the greatest distance of a camera from it. */
const surroundings = () => {
  let [sum, n] = [[0, 0, 0], 0];
  for (const person of data.people) {
    for (const { points } of Object.values(person.poses)) {
      for (let i = 0; i < points.length; i += 3) sum = along(sum, 0.001, points.slice(i, i + 3));
      n += points.length / 3;
    }
  }
  const middle = along([0, 0, 0], 1 / Math.max(1, n), sum);
  return { middle, far: Math.max(...data.cameras.map((c) => Math.hypot(...along(c.center, -1, middle)))) };
};

const { middle, far } = surroundings();
const eye = { turn: 0.6, rise: 0.35, distance: 1.8 * far };

/**
 * Return the projection of the present eye: a point in the world to pixels, or null behind the eye.
 *
 * @param {number} width
 * @param {number} height
 */
const projection = (width, height) => {
  const level = along(along([0, 0, 0], Math.cos(eye.turn), east), Math.sin(eye.turn), north);
  const back = along(along([0, 0, 0], Math.cos(eye.rise), level), Math.sin(eye.rise), up);
  const center = along(middle, eye.distance, back);
  const right = unit(cross(up, back));
  const top = cross(back, right);
  return (/** @type {Vector} */ point) => {
    const from = along(point, -1, center);
    const depth = -dot(from, back);
    if (depth < 0.05) return null;
    const scale = (FOCAL * height) / depth;
    return [width / 2 + scale * dot(from, right), height / 2 - scale * dot(from, top)];
  };
};

/** Segments of the floor's grid around the people, metres. */
const grid = () => {
  const base = along(middle, data.floor.offset - dot(middle, up), up);
  const [i, j] = [dot(base, east), dot(base, north)].map((x) => GRID_M * Math.round(x / GRID_M));
  const origin = along(along(along([0, 0, 0], data.floor.offset, up), i, east), j, north);
  const reach = GRID_M * GRID_CELLS;
  const segments = [];
  for (let k = -GRID_CELLS; k <= GRID_CELLS; k += 1) {
    for (const [a, b] of [[east, north], [north, east]]) {
      const start = along(origin, k * GRID_M, a);
      segments.push([along(start, -reach, b), along(start, reach, b)]);
    }
  }
  return segments;
};

const floor = grid();
const frusta = data.cameras.map(({ center, corners }) => {
  const ends = corners.map((corner) => along(center, 0.35 / Math.hypot(...corner), corner));
  return ends.flatMap((end, i) => [[center, end], [end, ends[(i + 1) % 4]]]);
});

const draw = () => {
  const begun = begin(byId("scene"));
  if (!begun) return;
  const { context, width, height } = begun;
  const project = projection(width, height);
  const strokeAll = (/** @type {Vector[][]} */ segments, /** @type {string} */ color, /** @type {number} */ line) => {
    context.beginPath();
    for (const [a, b] of segments) {
      const [start, end] = [project(a), project(b)];
      if (!start || !end) continue;
      context.moveTo(start[0], start[1]);
      context.lineTo(end[0], end[1]);
    }
    context.strokeStyle = color;
    context.lineWidth = line;
    context.stroke();
  };
  context.lineCap = "round";
  strokeAll(floor, token("--line"), 1);
  frusta.forEach((segments, view) => {
    strokeAll(segments, token("--muted"), 1);
    const at = project(data.cameras[view].center);
    context.fillStyle = token("--text");
    context.font = "11px system-ui, sans-serif";
    if (at) context.fillText(data.cameras[view].name, at[0] + 5, at[1] - 5);
  });
  for (const person of data.people) {
    const pose = poseOf(person, shown().at);
    if (!pose) continue;
    const place = (/** @type {number} */ i) => along([0, 0, 0], 0.001, pose.points.slice(3 * i, 3 * i + 3));
    const bones = person.figures[pose.figure].map(([a, b]) => [place(a), place(b)]);
    strokeAll(bones, token("--image-outline"), 5);
    strokeAll(bones, person.color, 3);
  }
};

/** Make the view. */
export const mountScene = () => {
  const canvas = /** @type {HTMLCanvasElement} */ (byId("scene"));
  canvas.onpointerdown = (event) => canvas.setPointerCapture(event.pointerId);
  canvas.onpointermove = (event) => {
    if (!canvas.hasPointerCapture(event.pointerId)) return;
    eye.turn -= event.movementX / 150;
    eye.rise = Math.max(-1.5, Math.min(1.5, eye.rise + event.movementY / 150));
    redraw();
  };
  canvas.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      eye.distance = Math.max(0.8, Math.min(40, eye.distance * Math.exp(event.deltaY / 600)));
      redraw();
    },
    { passive: false },
  );
  follow(draw);
};
