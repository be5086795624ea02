/** Zoom to joints on a frame that has been requested. */

/**
 * @typedef {{person: number, frame: number, points: string[]}} Place
 * @param {import("../model/store.js").Store} store
 * @param {import("./pane_grid.js").PaneGrid} grid
 * @returns {(place: Place | null) => void} zooms once the frame is drawn, unless the user goes elsewhere before
 */
export function zoomOnArrival(store, grid) {
  /** @type {Place | null} */
  let wanted = null;
  const zoomNow = () => {
    const { overlay, shown, target } = store.facts;
    if (target !== wanted?.frame) wanted = null;
    if (!wanted || overlay?.frame !== wanted.frame || shown?.frame !== wanted.frame) return;
    grid.frameJoints(wanted.person, wanted.points);
    wanted = null;
  };
  store.on(["overlay", "target"], zoomNow);
  return (place) => {
    wanted = place;
    zoomNow();
  };
}
