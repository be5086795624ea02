/** One cell for each frame and person, coloured by status; a press or a drag goes there. */

import { data, poseOf } from "./data.js";
import { begin, byId, token } from "./dom.js";
import { follow, seek, shown } from "./player.js";

const COLORS = { good: "--good", doubtful: "--warning", lost: "--bad", "": "--source-run" };

const draw = () => {
  const canvas = byId("timeline");
  const begun = begin(/** @type {HTMLCanvasElement} */ (canvas));
  if (!begun) return;
  const { context, width, height } = begun;
  const n = data.frames.length;
  const lane = (height - 8) / data.people.length;
  const { at } = shown();
  data.people.forEach((person, i) => {
    const top = 4 + i * lane;
    context.fillStyle = token("--track");
    context.fillRect(0, top, width, lane - 1);
    for (let k = 0; k < n; k += 1) {
      const pose = poseOf(person, k);
      if (!pose) continue;
      const [left, cell] = [(width * k) / n, Math.max(1, width / n - (width > 3 * n ? 1 : 0))];
      context.fillStyle = token(pose.keyframe ? "--source-hand" : COLORS[pose.status]);
      context.fillRect(left, top, cell, lane - 1);
    }
  });
  context.fillStyle = token("--accent");
  context.fillRect((width * (at + 0.5)) / n - 1, 0, 2, height);
  canvas.setAttribute("aria-valuemin", String(data.frames[0]));
  canvas.setAttribute("aria-valuemax", String(data.frames[n - 1]));
  canvas.setAttribute("aria-valuenow", String(data.frames[at]));
};

/** Make the timeline. */
export const mountTimeline = () => {
  const canvas = byId("timeline");
  const go = (/** @type {PointerEvent} */ event) =>
    seek(Math.floor((event.offsetX / canvas.clientWidth) * data.frames.length));
  canvas.onpointerdown = (event) => {
    canvas.setPointerCapture(event.pointerId);
    go(event);
  };
  canvas.onpointermove = (event) => canvas.hasPointerCapture(event.pointerId) && go(event);
  follow(draw);
};
