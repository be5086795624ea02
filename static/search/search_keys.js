/** Keys that start searches. */

import { inArea } from "../widgets/key_matching.js";

/**
 * @param {import("../model/store.js").Store} store
 * @param {import("../model/actions.js").Actions} actions
 * @param {import("../model/unavailable_reasons.js").Reasons} reasons
 */
export function searchBindings(store, actions, { search: why }) {
  const search = (/** @type {"step" | "stage" | "frame" | "contours" | "chains"} */ action) => () => {
    if (store.facts.connected && !store.facts.state?.job.running) actions.search(action);
  };
  return inArea("Search", [
    { keys: ["S"], label: "Search: one step", why, run: search("step") },
    { label: "Search: to the end of the stage", why, run: search("stage") },
    { label: "Search: repeat from the same start", run: () => actions.searchAgain() },
    { label: "Search: fit the contours, iteration by iteration", why, run: search("contours") },
    { label: "Search: fit the contours chain by chain, from a rough pose", why, run: search("chains") },
    { keys: ["F"], label: "Search: this frame", why, run: search("frame") },
  ]);
}
