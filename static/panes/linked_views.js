/**
 * Move views with others and with people. Linked views show the place that one is zoomed to, at the same size of the people.
 * Zoomed views follow the people from frame to frame.
 */

/**
 * @typedef {{camera: number, person: number, point: string, u: number, v: number}} Joint
 * @typedef {import("../model/store.js").Facts} Facts
 */

const STORED = "quadrille.linked-views";
const STORED_FOLLOWS = "quadrille.views-follow";

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
  const [u, v] = [mean(joints, "u"), mean(joints, "v")];
  return Math.sqrt(joints.reduce((sum, joint) => sum + (joint.u - u) ** 2 + (joint.v - v) ** 2, 0) / joints.length);
}

/** Moves zoomed views as the people in them move from one frame to another. */
export class PeopleFollower {
  isOn = localStorage.getItem(STORED_FOLLOWS) !== "false";
  /** @type {number | null} frame of the last overlay */
  #frame = null;
  /** @type {Map<number, Joint[]>} joints of each person in all views, on the last frame on which the person has a pose */
  #joints = new Map();
  /** @type {Map<number, number>} person whom the view of a camera follows, until it is moved by hand */
  #subjects = new Map();

  /** Follow people, or no longer. */
  toggle() {
    this.isOn = !this.isOn;
    localStorage.setItem(STORED_FOLLOWS, String(this.isOn));
  }

  /** Forget the people, who are those of another session. */
  forget() {
    this.#frame = null;
    this.#joints.clear();
    this.#subjects.clear();
  }

  /** @param {number} camera whose view was moved: it may show another person now */
  moved(camera) {
    this.#subjects.delete(camera);
  }

  /**
   * Take a new overlay. Views move only with the frame: a pose that is edited leaves them where they are.
   *
   * @param {import("./pane.js").Pane[]} panes by camera
   * @param {Facts} facts
   * @returns {boolean} whether views may have moved
   */
  take(panes, facts) {
    const { overlay, state } = facts;
    // The state of another frame does not tell who has a pose here, but a tracker that is ahead has posed the same people.
    if (!overlay || !state || (state.frame !== overlay.frame && !state.track.running)) return false;
    const placed = state.people.flatMap(({ source }, person) => (source === null ? [] : [person]));
    const joints = new Map(placed.map((person) => [person, overlay.handles.filter((joint) => joint.person === person)]));
    const isOther = this.isOn && this.#frame !== null && this.#frame !== overlay.frame;
    if (isOther) {
      panes.forEach((pane, camera) => this.#move(pane, camera, joints, facts));
    }
    this.#frame = overlay.frame;
    for (const [person, own] of joints) this.#joints.set(person, own);
    return isOther;
  }

  /**
   * @param {import("./pane.js").Pane} pane
   * @param {number} camera
   * @param {Map<number, Joint[]>} joints of the new frame
   * @param {Facts} facts
   */
  #move(pane, camera, joints, { state, session }) {
    const { view } = pane;
    const info = session?.cameras[camera];
    if (!info || view.zoom <= 1) return;
    if (view.isFramed) {
      const people = state?.solo ? [state.person] : [...joints.keys()];
      const box = boxOf(people.flatMap((person) => seen(joints.get(person) ?? [], camera, info)));
      if (box) view.refit(box);
      return;
    }
    const before = [...this.#joints.values()].flat().filter((joint) => joint.camera === camera);
    const person = this.#subjects.get(camera) ?? nearest(before, view.center)?.person;
    if (person === undefined) return;
    this.#subjects.set(camera, person);
    const now = new Map(joints.get(person)?.filter((joint) => joint.camera === camera).map((joint) => [joint.point, joint]));
    const both = before.filter((joint) => joint.person === person && now.has(joint.point));
    if (both.length === 0) return;
    const there = both.map(({ point }) => /** @type {Joint} */ (now.get(point)));
    view.follow(mean(there, "u") - mean(both, "u"), mean(there, "v") - mean(both, "v"));
  }
}

/**
 * Joints that lie in an image.
 *
 * @template {Joint} T
 * @param {T[]} joints
 * @param {number} camera
 * @param {{width: number, height: number}} image
 */
export function seen(joints, camera, { width, height }) {
  return joints.filter((joint) => joint.camera === camera && joint.u >= 0 && joint.v >= 0 && joint.u < width && joint.v < height);
}

/**
 * Box around some joints, image positions; null without any.
 *
 * @param {{u: number, v: number}[]} joints
 */
export function boxOf(joints) {
  if (joints.length === 0) return null;
  const [us, vs] = [joints.map(({ u }) => u), joints.map(({ v }) => v)];
  return { left: Math.min(...us), top: Math.min(...vs), right: Math.max(...us), bottom: Math.max(...vs) };
}

/**
 * @param {Joint[]} joints
 * @param {"u" | "v"} axis
 */
function mean(joints, axis) {
  return joints.reduce((sum, joint) => sum + joint[axis], 0) / joints.length;
}
