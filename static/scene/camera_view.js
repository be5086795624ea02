/** Look through a camera in the 3-D view, and mark its pane. */

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
    store.on(["state", "session"], () => this.#mark());
  }

  /** Look through the camera that fills the grid, or else through the active one (toggle). */
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
