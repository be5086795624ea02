/** Menu of poses to copy: of other people, of the neighbouring frames and of the nearest keyframes. */

import { personCells } from "../model/selectors.js";
import { byId } from "../widgets/elements.js";
import { mountMenu } from "../widgets/menu.js";

const MAX_KEYFRAMES = 12;

/**
 * @param {import("../model/store.js").Store} store
 * @param {import("./posing.js").Posing} posing
 */
export function mountCopyMenu(store, posing) {
  mountMenu(byId("copy-pose", HTMLButtonElement), byId("copy-menu", HTMLElement), () => items());

  /** @returns {{items: import("../widgets/menu.js").MenuItem[], note?: string}} */
  function items() {
    const { shown, session, state } = store.facts;
    if (!shown || !session) return { items: [] };
    const here = shown.frame;
    const cells = personCells(store.facts);
    const keyframes = [...cells]
      .filter(([frame, cell]) => cell.keyframe && frame !== here)
      .map(([frame]) => frame)
      .sort((a, b) => Math.abs(a - here) - Math.abs(b - here))
      .slice(0, MAX_KEYFRAMES)
      .sort((a, b) => a - b);
    const others = [...session.people.entries()].filter(([person]) => person !== (state?.person ?? 0));
    const items = [
      ...others.map(([person, { name }]) => ofPerson(name, person)),
      item("Previous frame", "", here - 1, cells.has(here - 1)),
      item("Next frame", "", here + 1, cells.has(here + 1)),
      ...keyframes.map((frame) => item(`Keyframe ${frame}`, away(frame - here), frame, true)),
    ];
    const note = keyframes.length ? undefined : "No other keyframes. A frame becomes a keyframe when you edit its pose.";
    return { items, note };
  }

  /**
   * @param {string} text
   * @param {string} note
   * @param {number} frame
   * @param {boolean} hasPose
   */
  function item(text, note, frame, hasPose) {
    const title = hasPose ? `Copy the pose of frame ${frame}` : `Frame ${frame} has no pose`;
    return { text, note: hasPose ? note : "no pose", title, isDisabled: !hasPose, run: () => posing.copyFrom(frame) };
  }

  /**
   * @param {string} name
   * @param {number} person
   */
  function ofPerson(name, person) {
    const title = `Copy the joint angles of ${name}; position and orientation stay`;
    return { text: name, note: "this frame", title, run: () => posing.copyPerson(person) };
  }
}

/** @param {number} frames */
function away(frames) {
  return frames < 0 ? `${-frames} earlier` : `${frames} later`;
}
