/** Link the zoom of all views: the others show the place that one is zoomed to, at the same size of the people. */

/** @typedef {{camera: number, person: number, point: string, u: number, v: number}} Joint */

const STORED = "quadrille.linked-views";

/** @returns {boolean} whether this browser links views */
export function keptLink() {
  return localStorage.getItem(STORED) === "true";
}

/** @param {boolean} isLinked */
export function keepLink(isLinked) {
  localStorage.setItem(STORED, String(isLinked));
}

/**
 * Let other views show the joint nearest to the middle of one view, at the size that its person has there. Views that do
 * not see the joint stay as they are.
 *
 * @param {import("./pane.js").Pane[]} panes by camera
 * @param {number} source camera of the view that the others follow
 * @param {Joint[]} joints in all views
 */
export function followView(panes, source, joints) {
  const { view } = panes[source];
  if (view.isReset) {
    panes.forEach((pane, camera) => camera !== source && pane.reset());
    return;
  }
  const middle = view.center;
  const near = nearest(joints.filter(({ camera }) => camera === source), middle);
  if (!near) return;
  const ofPerson = joints.filter(({ person }) => person === near.person);
  const size = spread(ofPerson.filter(({ camera }) => camera === source));
  panes.forEach((pane, camera) => {
    const seen = ofPerson.filter((joint) => joint.camera === camera);
    const there = seen.find(({ point }) => point === near.point);
    const own = spread(seen);
    if (camera === source || !there || !(own > 0) || !(size > 0)) return;
    // The joint is as far from the middle here as there, so that the views do not jump from joint to joint.
    const share = own / size;
    pane.look({ u: there.u, v: there.v + (middle.v - near.v) * share }, view.scale / share);
  });
}

/**
 * @param {Joint[]} joints
 * @param {{u: number, v: number}} at
 */
function nearest(joints, { u, v }) {
  const off = (/** @type {Joint} */ joint) => Math.hypot(joint.u - u, joint.v - v);
  return joints.reduce((best, joint) => (!best || off(joint) < off(best) ? joint : best), /** @type {Joint | null} */ (null));
}

/**
 * Root mean square distance of joints from their mean, px.
 *
 * @param {Joint[]} joints
 */
function spread(joints) {
  const mean = (/** @type {number[]} */ values) => values.reduce((sum, value) => sum + value, 0) / values.length;
  const u = mean(joints.map((joint) => joint.u));
  const v = mean(joints.map((joint) => joint.v));
  return Math.sqrt(mean(joints.map((joint) => (joint.u - u) ** 2 + (joint.v - v) ** 2)));
}
