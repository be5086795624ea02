/** Tooltip of a cell of the timeline, above the pointer at once. The slider's text has the same words for screen readers. */

import { make } from "../widgets/elements.js";

const MARGIN_PX = 6;

export class CellTip {
  #tip = make("div", { id: "cell-tip", "aria-hidden": "true", hidden: true });
  #over;

  /** @param {HTMLElement} over the timeline */
  constructor(over) {
    this.#over = over;
    over.parentElement?.append(this.#tip);
  }

  /**
   * @param {string[]} lines the first is the heading
   * @param {number} clientX of the pointer
   */
  show(lines, clientX) {
    this.#tip.replaceChildren(...lines.map((text) => make("div", {}, text)));
    this.#tip.hidden = false;
    const { top } = this.#over.getBoundingClientRect();
    const { width, height } = this.#tip.getBoundingClientRect();
    const left = Math.max(MARGIN_PX, Math.min(clientX - width / 2, innerWidth - width - MARGIN_PX));
    Object.assign(this.#tip.style, { left: `${left}px`, top: `${top - height - MARGIN_PX}px` });
  }

  hide() {
    this.#tip.hidden = true;
  }
}
