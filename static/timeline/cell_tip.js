/** Tooltip of a cell of the timeline, above the pointer at once. The slider's text has the same words for screen readers. */

import { make } from "../widgets/elements.js";

const MARGIN_PX = 6;

/** @param {HTMLElement} over the timeline */
export function mountCellTip(over) {
  const tip = make("div", { id: "cell-tip", "aria-hidden": "true", hidden: true });
  over.parentElement?.append(tip);

  /**
   * @param {string[]} lines the first is the heading
   * @param {number} clientX of the pointer
   */
  function show(lines, clientX) {
    tip.replaceChildren(...lines.map((text) => make("div", {}, text)));
    tip.hidden = false;
    const { top } = over.getBoundingClientRect();
    const { width, height } = tip.getBoundingClientRect();
    const left = Math.max(MARGIN_PX, Math.min(clientX - width / 2, innerWidth - width - MARGIN_PX));
    Object.assign(tip.style, { left: `${left}px`, top: `${top - height - MARGIN_PX}px` });
  }

  function hide() {
    tip.hidden = true;
  }

  return { show, hide };
}
