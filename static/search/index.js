/**
 * Search: watch, replay and compare searches, compare tracked poses, and the cost landscape.
 *
 * The room imports `widgets`, `model`, `panes` and `timeline`.
 */

import { mountCostLandscape } from "./cost_landscape.js";
import { mountRunComparison } from "./run_comparison.js";
import { searchBindings } from "./search_keys.js";
import { mountSearchPanel } from "./search_panel.js";

/** @typedef {ReturnType<typeof mount>} SearchRoom */

/**
 * Build the tabs of the drawer that show searches.
 *
 * @param {import("../model/index.js").Context} context
 * @param {import("../timeline/index.js").TimelineRoom} timeline
 */
export function mount({ store, send, actions, navigation, reasons }, { drawer }) {
  mountSearchPanel(store, actions, send);
  watchTab(store, send);
  mountCostLandscape(store, send);
  mountRunComparison(store, navigation, actions, () => drawer.open("runs"));
  return { bindings: searchBindings(store, actions, reasons) };
}

/**
 * Tell the program which of the tabs that it computes for is open.
 *
 * @param {import("../model/store.js").Store} store
 * @param {(message: import("../model/protocol.js").ClientMessage) => void} send
 */
function watchTab(store, send) {
  /** @type {"search" | "landscape" | null} */
  let watched = null;
  store.on(["drawer", "connected"], () => {
    const { drawer, connected } = store.facts;
    const tab = connected && (drawer === "search" || drawer === "landscape") ? drawer : null;
    if (connected && tab !== watched) send({ type: "watch", tab });
    watched = tab;
  });
}
