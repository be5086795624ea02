/** Doubted keyframes in words. */

import { px } from "../widgets/text.js";

/**
 * The contradictions of a keyframe, as in "with its neighbours: left wrist 27 cm off".
 *
 * @param {import("./protocol.js").KeyframeDoubt} doubt
 * @param {import("./protocol.js").SessionMessage} session
 * @returns {string[]}
 */
export function contradictions({ distance_cm, point, views, reason }, { cameras }) {
  return [
    ...(distance_cm === null ? [] : [`with its neighbours: ${point} ${distance_cm.toFixed(0)} cm off`]),
    ...views.map(({ camera, cost_px, usual_px }) => `with ${cameras[camera].name}: ${px(cost_px)}, usually ${px(usual_px)}`),
    ...(reason ? [`with the footage: ${reason}`] : []),
  ];
}

/**
 * The doubt about a person's keyframe; undefined where there is none.
 *
 * @param {import("./store.js").Facts} facts
 * @param {number} frame
 * @param {number} person
 */
export function keyframeDoubt({ keyframeDoubts }, frame, person) {
  return keyframeDoubts.find((one) => one.frame === frame && one.person === person);
}
