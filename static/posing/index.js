/**
 * Posing: edit the pose of a person by numbers, keys and pins.
 *
 * The room imports `widgets`, `model` and `panes`.
 */

import { byId } from "../widgets/elements.js";
import { makeCurveEdits } from "./curve_edits.js";
import { makeEpipolarCheck } from "./epipolar_check.js";
import { mountFrameCard } from "./frame_card.js";
import { mountJointBar } from "./joint_bar.js";
import { mountPinBar } from "./pin_bar.js";
import { makePinning } from "./pinning.js";
import { makePosing } from "./posing.js";
import { depthBindings, epipolarBindings, pinBindings, posingBindings } from "./posing_keys.js";

/** @typedef {ReturnType<typeof mount>} PosingRoom */

/**
 * Build the bar of the joint, the pins and the frame card.
 *
 * @param {import("../model/index.js").Context} context
 * @param {import("../panes/index.js").Panes} panes
 */
export function mount({ store, send, say, reasons }, { grid }) {
  const pinning = makePinning(store, send, say);
  grid.addPointerTarget(pinning);
  const epipolar = makeEpipolarCheck(store, send);
  grid.addPointerTarget(epipolar); // before pins and joints
  const posing = makePosing(store, send);
  const jointBar = mountJointBar(byId("joint-bar", HTMLElement), store, posing, say);
  mountFrameCard(store, posing);
  mountPinBar(store, pinning);
  const bindings = [...posingBindings(posing, jointBar, reasons.away), ...pinBindings(pinning, reasons.away), ...epipolarBindings(epipolar, reasons.away), ...depthBindings(store, grid, reasons.away)];
  return { posing, curveEdits: makeCurveEdits(store, posing, send), pinning, epipolar, bindings };
}
