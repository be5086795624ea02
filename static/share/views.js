/** The camera views: a picture of the footage, and the bodies as lines over it. */

import { data, poseOf } from "./data.js";
import { make } from "../widgets/elements.js";
import { begin, byId, token } from "./dom.js";
import { change, follow, redraw, shown } from "./player.js";

const AHEAD = 8;
/** Number of frames whose pictures are loaded before they are shown. */

/** @type {Map<string, HTMLImageElement>} */
const images = new Map();

/**
 * Return a picture, which may still be loading.
 *
 * @param {number} view
 * @param {number} at
 */
const picture = (view, at) => {
  const address = data.pictures[view][at];
  let image = images.get(address);
  if (!image) {
    image = new Image();
    image.onload = redraw;
    image.src = address;
    images.set(address, image);
    if (images.size > 40 * data.pictures.length) images.delete(/** @type {string} */ (images.keys().next().value));
  }
  return image;
};

/**
 * Trace polylines into the path of a context.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {number[][]} lines
 */
const trace = (context, lines) => {
  context.beginPath();
  for (const line of lines) {
    let [u, v] = line;
    context.moveTo(u, v);
    for (let i = 2; i < line.length; i += 2) {
      u += line[i];
      v += line[i + 1];
      context.lineTo(u, v);
    }
  }
};

/**
 * Stroke the path of a context, outlined so that it is legible on any ground.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {string} color
 * @param {number} width of the line, in the units of the context
 * @param {number} opacity
 */
const stroke = (context, color, width, opacity) => {
  context.globalAlpha = opacity;
  context.lineWidth = 2.2 * width;
  context.strokeStyle = token("--image-outline");
  context.stroke();
  context.lineWidth = width;
  context.strokeStyle = color;
  context.stroke();
  context.globalAlpha = 1;
};

/**
 * Draw the bodies of a frame over a view.
 *
 * @param {CanvasRenderingContext2D} context in the units of the lines
 * @param {number} view
 * @param {number} width of lines, in these units
 */
const drawBodies = (context, view, width) => {
  const { at, contours, bones } = shown();
  for (const lines of data.lines[at][view]) {
    const person = data.people.find((p) => p.index === lines.person);
    const pose = person && poseOf(person, at);
    if (!pose) continue;
    if (contours) {
      trace(context, lines.hidden);
      stroke(context, person.color, width, 0.35);
      trace(context, lines.visible);
      stroke(context, person.color, width, 1);
    }
    if (!bones) continue;
    context.beginPath();
    for (const [a, b] of person.figures[pose.figure]) {
      const [u0, v0, u1, v1] = [2 * a, 2 * a + 1, 2 * b, 2 * b + 1].map((i) => lines.points[i]);
      if (u0 === null || v0 === null || u1 === null || v1 === null) continue;
      context.moveTo(u0, v0);
      context.lineTo(u1, v1);
    }
    stroke(context, contours ? token("--image-neutral") : person.color, width, 1);
  }
};

/**
 * Draw a view.
 *
 * @param {HTMLCanvasElement} canvas
 * @param {number} view
 */
const draw = (canvas, view) => {
  const begun = begin(canvas);
  if (!begun) return;
  const { context, width, height } = begun;
  const camera = data.cameras[view];
  const scale = Math.min(width / camera.width, height / camera.height);
  context.translate((width - scale * camera.width) / 2, (height - scale * camera.height) / 2);
  context.scale(scale, scale);
  const { at, isPlaying } = shown();
  const image = picture(view, at);
  if (image.complete && image.naturalWidth) context.drawImage(image, 0, 0, camera.width, camera.height);
  for (let next = at + 1; next <= at + (isPlaying ? AHEAD : 1) && next < data.frames.length; next += 1) picture(view, next);
  context.beginPath();
  context.rect(0, 0, camera.width, camera.height);
  context.clip();
  context.translate(0.5, 0.5); // pixel centres lie at integers
  context.scale(1 / data.units_per_px, 1 / data.units_per_px);
  context.lineJoin = "round";
  drawBodies(context, view, (1.6 * data.units_per_px) / scale);
};

/** Lay out the views: as many columns as make them largest. */
const layOut = () => {
  const section = byId("views");
  const { only } = shown();
  const n = only === null ? data.cameras.length : 1;
  const { width, height } = data.cameras[0];
  let [columns, best] = [1, 0];
  for (let k = 1; k <= n; k += 1) {
    const scale = Math.min(section.clientWidth / k / width, section.clientHeight / Math.ceil(n / k) / height);
    if (scale > best) [columns, best] = [k, scale];
  }
  section.style.gridTemplate = `repeat(${Math.ceil(n / columns)}, minmax(0, 1fr)) / repeat(${columns}, minmax(0, 1fr))`;
};

/**
 * Show one view alone, or all.
 *
 * @param {number} view
 */
export const toggleOnly = (view) => {
  if (view < data.cameras.length) change({ only: shown().only === view ? null : view });
};

/** Make the views. */
export const mountViews = () => {
  const panes = data.cameras.map((camera, view) => {
    const title = `Show ${camera.name} alone, or all (${view + 1})`;
    const canvas = make("canvas", { role: "img", "aria-label": camera.name, title, onclick: () => toggleOnly(view) });
    const pane = make("div", "view", canvas, make("span", {}, camera.name));
    byId("views").append(pane);
    return { pane, canvas };
  });
  follow(() => {
    const { only } = shown();
    panes.forEach(({ pane }, view) => (pane.hidden = only !== null && only !== view));
    layOut();
    panes.forEach(({ canvas, pane }, view) => !pane.hidden && draw(canvas, view));
  });
};
