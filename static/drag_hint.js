/** What a drag is doing, and what else it could, said beside the pointer. */

/** @type {Record<import("./protocol.js").DragMode, string>} */
const HINTS = {
  move: "Shift or Alt: turn · Ctrl: depth",
  turn: "Turning about the line of sight",
  push: "Depth: up is away",
};

export class DragHint {
  #element = document.createElement("div");

  constructor() {
    this.#element.className = "drag-hint";
    this.#element.hidden = true;
    this.#element.setAttribute("aria-hidden", "true");
    document.body.append(this.#element);
  }

  /**
   * @param {import("./protocol.js").DragMode} mode
   * @param {MouseEvent} event
   */
  show(mode, { clientX, clientY }) {
    this.#element.textContent = HINTS[mode];
    this.#element.classList.toggle("is-quiet", mode === "move");
    this.#element.hidden = false;
    const left = Math.min(clientX + 18, innerWidth - this.#element.offsetWidth - 8);
    this.#element.style.transform = `translate(${left}px, ${Math.min(clientY + 22, innerHeight - 30)}px)`;
  }

  hide() {
    this.#element.hidden = true;
  }
}

/**
 * What the keys held down make of a drag.
 *
 * @param {MouseEvent | KeyboardEvent} event
 * @returns {import("./protocol.js").DragMode}
 */
export function modeOf(event) {
  if (event.ctrlKey || event.metaKey) return "push";
  return event.altKey || event.shiftKey ? "turn" : "move";
}
