/** Text beside the joint under the pointer: what a drag would move, and which joints lie under it. */

import { displayName } from "../widgets/text.js";

/** @typedef {import("./drawing.js").PlacedHandle} PlacedHandle */

/**
 * Lines of the label, the joint that a press would take first.
 *
 * @param {PlacedHandle} meant
 * @param {PlacedHandle[]} overlapping the joints under the pointer with the one meant
 * @param {import("../model/protocol.js").PersonInfo[]} people
 */
export function jointLabel({ handle }, overlapping, people) {
  const turns = people[handle.person]?.heading.includes(handle.point) ?? false;
  const by = handle.hidden_by === null ? "" : ` by ${people[handle.hidden_by]?.name}`;
  const notes = [turns && "turns the body", !handle.visible && `hidden${by}`, handle.held && "held"].filter(Boolean);
  const first = named(handle, overlapping, people) + (notes.length ? ` (${notes.join(", ")})` : "");
  const others = overlapping.filter((one) => one.handle !== handle);
  return [first, ...others.map((one) => `Click: ${named(one.handle, overlapping, people)}`)];
}

/**
 * Name of a joint, with its person where joints of several people overlap.
 *
 * @param {import("../model/protocol.js").Handle} handle
 * @param {PlacedHandle[]} overlapping
 * @param {import("../model/protocol.js").PersonInfo[]} people
 */
function named(handle, overlapping, people) {
  const isShared = overlapping.some((one) => one.handle.person !== handle.person);
  const name = displayName(handle.point);
  return isShared ? `${people[handle.person]?.name} ${name}` : name;
}
