/** Go to a person on a frame, with a limb selected and the views zoomed to it once the frame is drawn. */

import { zoomOnArrival } from "../panes/arrival_zoom.js";

/** @typedef {{person: number, frame: number, limb?: string}} Goal limb: name for display; empty or missing for none */

/** Limb of shoulders and hips in proposals. */
const TRUNK = "trunk";

/** @typedef {ReturnType<typeof makeVisits>} Visits */

/**
 * @param {import("../model/index.js").Context} context
 * @param {import("../panes/index.js").Panes} panes
 */
export function makeVisits(context, panes) {
  const zoomTo = zoomOnArrival(context.store, panes.grid);

  /** @param {Goal} goal */
  function go({ person, frame, limb = "" }) {
    const { store, navigation, actions } = context;
    const info = store.facts.session?.people[person];
    if (!info) return;
    navigation.pause();
    navigation.goTo(frame);
    const points = limb === TRUNK ? info.heading : info.points.filter((point) => limb && info.point_limbs[point]?.name === limb);
    const point = points.filter((one) => !info.minor.includes(one)).at(-1) ?? points.at(-1) ?? null;
    const { state } = store.facts;
    if (state?.person !== person || (point && state.point !== point)) actions.selectPerson(person, point);
    zoomTo(points.length ? { person, frame, points } : null);
  }

  return { go };
}
