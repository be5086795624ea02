/** Leave out joints that are too close together to be picked by pointer. All distances are CSS pixels. */

/** @typedef {import("./drawing.js").PlacedHandle} PlacedHandle */

/** Picking radius of a joint. */
export const GRAB_RADIUS = 12;

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
