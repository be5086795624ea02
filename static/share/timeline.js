/** One cell for each frame and person, coloured by status; a press or a drag goes there. */

import { data, poseOf } from "./data.js";
import { fillRect } from "../widgets/canvas.js";
import { showPosition } from "../widgets/separator.js";
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
    fillRect(context, token("--track"), 0, top, width, lane - 1);
    for (let k = 0; k < n; k += 1) {
      const pose = poseOf(person, k);
      if (!pose) continue;
      const [left, cell] = [(width * k) / n, Math.max(1, width / n - (width > 3 * n ? 1 : 0))];
      fillRect(context, token(pose.keyframe ? "--source-hand" : COLORS[pose.status]), left, top, cell, lane - 1);
    }
  });
  fillRect(context, token("--accent"), (width * (at + 0.5)) / n - 1, 0, 2, height);
  showPosition(canvas, { now: data.frames[at], min: data.frames[0], max: data.frames[n - 1] });
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
