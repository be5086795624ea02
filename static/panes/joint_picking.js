/** Which joint a press takes where several lie under the pointer. All distances are CSS pixels. */

/** @typedef {import("./drawing.js").PlacedHandle} PlacedHandle */

/** Picking radius of a joint. */
export const GRAB_RADIUS = 12;
/** Radius of the mark of a joint: the mark under the pointer is meant, rather than another one near it. */
const MARK_RADIUS = 5;
/** Joints nearer to each other than this overlap: they are offered together. */
const OVERLAP_PX = 8;

export class JointPicking {
  /** The joints that overlap under the pointer, by name. @type {string[]} */
  #offered = [];
  /** The joint that a press takes; null: the nearest. @type {string | null} */
  #chosen = null;
  /** @type {string | null} the joint meant last */
  #meant = null;

  /**
   * The joint that a press takes, and the joints that overlap it, itself included; null if none is near.
   *
   * @param {PlacedHandle[]} placed
   * @param {{x: number, y: number}} at
   * @param {number} person the active person
   * @returns {{meant: PlacedHandle, overlapping: PlacedHandle[]} | null}
   */
  pick(placed, at, person) {
    const distance = (/** @type {PlacedHandle} */ one) => Math.hypot(one.x - at.x, one.y - at.y);
    // The active person's mark comes first, then another person's, then joints beside the pointer.
    const rank = (/** @type {PlacedHandle} */ one) => (distance(one) > MARK_RADIUS ? 2 : Number(one.handle.person !== person));
    const near = placed.filter((one) => distance(one) <= GRAB_RADIUS).sort((a, b) => rank(a) - rank(b) || distance(a) - distance(b));
    if (near.length === 0) {
      this.forget();
      return null;
    }
    const overlapping = near.filter((one) => Math.hypot(one.x - near[0].x, one.y - near[0].y) <= OVERLAP_PX);
    const names = overlapping.map(nameOf).sort();
    if (names.join(" ") !== this.#offered.join(" ")) [this.#offered, this.#chosen] = [names, null];
    const meant = overlapping.find((one) => nameOf(one) === this.#chosen) ?? overlapping[0];
    this.#meant = nameOf(meant);
    return { meant, overlapping };
  }

  /** Take the next of the overlapping joints. Returns whether there is another. */
  next() {
    if (this.#offered.length < 2) return false;
    const index = this.#offered.indexOf(this.#meant ?? "");
    this.#chosen = this.#offered[(index + 1) % this.#offered.length];
    return true;
  }

  /** Offer the nearest joint again. */
  forget() {
    [this.#offered, this.#chosen, this.#meant] = [[], null, null];
  }
}

/** @param {PlacedHandle} placed */
function nameOf({ handle }) {
  return `${handle.person}:${handle.point}`;
}

/**
 * Leave out minor joints that overlap others. They are shown when the view is zoomed in.
 *
 * @param {PlacedHandle[]} placed
 * @param {import("../model/protocol.js").PersonInfo[]} people
 * @param {import("../model/store.js").Joint | null} held the joint that is being dragged; it is always kept
 */
export function decluttered(placed, people, held) {
  const isMinor = (/** @type {PlacedHandle} */ { handle }) =>
    people[handle.person]?.minor.includes(handle.point) ?? false;
  const major = placed.filter((one) => !isMinor(one));
  /** @type {PlacedHandle[]} */
  const kept = [];
  for (const one of placed) {
    if (!isMinor(one)) continue;
    const isHeld = held?.person === one.handle.person && held.point === one.handle.point;
    const isApart = (/** @type {PlacedHandle} */ { x, y }) => Math.hypot(x - one.x, y - one.y) >= 2 * GRAB_RADIUS;
    if (isHeld || (major.every(isApart) && kept.every(isApart))) kept.push(one);
  }
  // Major joints are drawn on top.
  return [...kept, ...major];
}
