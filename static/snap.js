/** Looking through a camera in the 3-D view: which camera is meant, and the mark on its pane. */

export class Snap {
  #store;
  #grid;
  #send;
  /** The camera whose pane the pointer was in last. */
  #last = 0;

  /**
   * @param {HTMLElement} element of the panes
   * @param {import("./store.js").Store} store
   * @param {import("./pane_grid.js").PaneGrid} grid
   * @param {(message: import("./protocol.js").ClientMessage) => void} send
   */
  constructor(element, store, grid, send) {
    this.#store = store;
    this.#grid = grid;
    this.#send = send;
    element.addEventListener("pointerover", ({ target }) => {
      const camera = grid.panes.findIndex((pane) => target instanceof Node && pane.element.contains(target));
      if (camera >= 0) this.#last = camera;
    });
    store.subscribe((changed) => {
      if (changed.has("state") || changed.has("session")) this.#mark();
    });
  }

  /** Look through the camera of the pane that fills the grid, else of the one pointed at last; or no longer. */
  toggle() {
    const { state, filled, connected } = this.#store.facts;
    if (!state || !connected) return;
    const camera = filled ?? Math.min(this.#last, this.#grid.panes.length - 1);
    this.#send({ type: "snap", camera: state.snapped === camera ? null : camera });
  }

  #mark() {
    const snapped = this.#store.facts.state?.snapped ?? null;
    this.#grid.panes.forEach((pane, camera) => pane.element.classList.toggle("is-snapped", camera === snapped));
  }
}
