/** Expose the state of the page to browser tests, as `window.quadrille`. */

/**
 * @param {import("../model/index.js").Context} context
 * @param {import("../panes/pane_grid.js").PaneGrid} grid
 * @param {import("../widgets/key_matching.js").Binding[]} bindings all keys and commands of the page
 */
export function exposeState({ store, latency }, grid, bindings) {
  const quadrille = {
    bindings,
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
