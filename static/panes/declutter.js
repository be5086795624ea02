/** Which joints of a view a hand can tell apart. All distances are CSS pixels. */

/** @typedef {import("./drawing.js").PlacedHandle} PlacedHandle */

/** How far from a joint it can be taken. */
export const GRAB_RADIUS = 12;

/**
 * Leave out the minor joints on which a hand might take a neighbour instead, or be taken for it: zoomed in, they are there.
 *
 * @param {PlacedHandle[]} placed
 * @param {import("../model/protocol.js").PersonInfo[]} people
 * @param {import("../model/store.js").Joint | null} held the joint that a hand holds; it stays
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
  // The joints that matter are drawn over the others.
  return [...kept, ...major];
}
