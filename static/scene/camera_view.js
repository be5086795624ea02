/** Look through a camera in the 3-D view, and mark its pane. */

/** @typedef {ReturnType<typeof mountCameraView>} CameraView */

/**
 * @param {import("../model/store.js").Store} store
 * @param {import("../panes/pane_grid.js").PaneGrid} grid
 * @param {(message: import("../model/protocol.js").ClientMessage) => void} send
 */
export function mountCameraView(store, grid, send) {
  store.on(["state", "session"], () => mark());

  /** Look through the camera that fills the grid, or else through the active one (toggle). */
  function toggle() {
    const { state, filled, active, connected } = store.facts;
    if (!state || !connected) return;
    const camera = filled ?? active ?? 0;
    send({ type: "snap", camera: state.snapped === camera ? null : camera });
  }

  function mark() {
    const snapped = store.facts.state?.snapped ?? null;
    grid.panes.forEach((pane, camera) => pane.element.classList.toggle("is-snapped", camera === snapped));
  }

  return { toggle };
}
