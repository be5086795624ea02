/** Looking through a camera in the 3-D view: which camera is meant, and the mark on its pane. */

export class CameraView {
  #store;
  #grid;
  #send;

  /**
   * @param {import("../model/store.js").Store} store
   * @param {import("../panes/pane_grid.js").PaneGrid} grid
   * @param {(message: import("../model/protocol.js").ClientMessage) => void} send
   */
  constructor(store, grid, send) {
    this.#store = store;
    this.#grid = grid;
    this.#send = send;
    store.subscribe((changed) => {
      if (changed.has("state") || changed.has("session")) this.#mark();
    });
  }

  /** Look through the camera of the pane that fills the grid, else of the one pointed at last; or no longer. */
  toggle() {
    const { state, filled, active, connected } = this.#store.facts;
    if (!state || !connected) return;
    const camera = filled ?? active ?? 0;
    this.#send({ type: "snap", camera: state.snapped === camera ? null : camera });
  }

  #mark() {
    const snapped = this.#store.facts.state?.snapped ?? null;
    this.#grid.panes.forEach((pane, camera) => pane.element.classList.toggle("is-snapped", camera === snapped));
  }
}
