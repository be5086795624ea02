/**
 * Search: watch, replay and compare searches, compare tracked poses, and the cost landscape.
 *
 * The room imports `widgets`, `model`, `panes` and `timeline`.
 */

import { CostLandscape } from "./cost_landscape.js";
import { RunComparison } from "./run_comparison.js";
import { searchBindings } from "./search_keys.js";
import { SearchPanel } from "./search_panel.js";

/** @typedef {ReturnType<typeof mount>} SearchRoom */

/**
 * Build the tabs of the drawer that show searches.
 *
 * @param {import("../model/index.js").Context} context
 * @param {import("../timeline/index.js").TimelineRoom} timeline
 */
export function mount({ store, send, actions, navigation, reasons }, { drawer }) {
  new SearchPanel(store, actions, send);
  new CostLandscape(store, send);
  new RunComparison(store, navigation, actions, () => drawer.open("runs"));
  return { bindings: searchBindings(store, actions, reasons) };
}
