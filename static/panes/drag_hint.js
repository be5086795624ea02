/**
 * Hint at the bottom of a pane: what a drag does, and which keys change it.
 *
 * The hint does not follow the pointer, where it would cover the joint and cost a repaint with each move.
 */

import { make } from "../widgets/elements.js";

/** @type {Record<import("../model/protocol.js").DragMode, string>} */
const HINTS = {
  move: "Shift: turn or tilt · Ctrl: depth · Alt or Ctrl+Shift: bend the trunk",
  turn: "Turning about the line of sight",
  bend: "Bending the trunk: the other limbs stay in place",
  push: "Depth: drag up to move away",
};

export class DragHint {
  #element = make("div", { className: "drag-hint", "aria-hidden": "true", hidden: true });
  /** @type {import("../model/protocol.js").DragMode | null} the mode of the text that is shown */
  #mode = null;

  constructor() {
    document.body.append(this.#element);
  }

  /**
   * @param {import("../model/protocol.js").DragMode} mode
   * @param {HTMLElement} pane
   */
  show(mode, pane) {
    if (mode === this.#mode) return;
    this.#mode = mode;
    this.#element.textContent = HINTS[mode];
    this.#element.classList.toggle("is-quiet", mode === "move");
    this.#element.hidden = false;
    const { left, bottom, width } = pane.getBoundingClientRect();
    this.#element.style.left = `${left + width / 2}px`;
    this.#element.style.top = `${bottom - 8}px`;
  }

  hide() {
    this.#element.hidden = true;
    this.#mode = null;
  }
}

/**
 * Drag mode of the modifier keys.
 *
 * @param {MouseEvent | KeyboardEvent} event
 * @returns {import("../model/protocol.js").DragMode}
 */
export function modeOf(event) {
  const isControl = event.ctrlKey || event.metaKey;
  // Some window managers move windows by Alt and the pointer.
  if (event.altKey || (isControl && event.shiftKey)) return "bend";
  if (isControl) return "push";
  return event.shiftKey ? "turn" : "move";
}
