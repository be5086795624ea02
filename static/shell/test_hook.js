/** Expose the state of the page to browser tests, as `window.quadrille`. */

import { obeys } from "../widgets/key_matching.js";
import { obey } from "./keys.js";

/**
 * @param {import("../model/index.js").Context} context
 * @param {import("../panes/pane_grid.js").PaneGrid} grid
 * @param {import("../widgets/key_matching.js").Binding[]} bindings all keys and commands of the page
 */
export function exposeState({ store, latency, say }, grid, bindings) {
  const quadrille = {
    bindings,
    /** Run a command as its key does. Returns whether there is one with the label. */
    command(/** @type {string} */ label) {
      const binding = bindings.find((one) => one.label === label);
      if (binding) obey(binding, new KeyboardEvent("keydown"), say);
      return !!binding;
    },
    obeying: (/** @type {KeyboardEvent} */ event) => bindings.filter((one) => obeys(one, event)).map(({ label }) => label),
    latencies: latency.latencies,
    toClient: grid.toClient.bind(grid),
    /** Serializable copy of the facts, with sizes instead of bitmaps. */
    get state() {
      const { facts } = store;
      const { frame, pictures = new Map() } = facts.shown ?? {};
      const sizes = [...pictures].map(([key, { bitmap }]) => [key, [bitmap.width, bitmap.height]]);
      const shown = { frame, pictures: Object.fromEntries(sizes) };
      const placeholder = facts.placeholder && { ...facts.placeholder, pictures: facts.placeholder.pictures !== null };
      const views = grid.panes.map(({ view }) => ({ zoom: view.zoom, scale: view.scale, origin: view.origin }));
      return { ...facts, timeline: Object.fromEntries(facts.timeline), shown, placeholder, views };
    },
  };
  Object.assign(window, { quadrille });
}
