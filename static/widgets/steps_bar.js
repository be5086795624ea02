/** One bar for work of several steps: those that are done are full, and the present one is marked. */

import { make } from "./elements.js";

export class StepsBar {
  element = make("ol", { className: "steps-bar", "aria-label": "Steps", hidden: true });
  #shown = "";

  /**
   * @param {string[]} steps in order; none hides the bar
   * @param {number} now rank of the present one
   * @param {number} share of the present one that is done, 0 to 1
   */
  show(steps, now, share) {
    const described = JSON.stringify([steps, now, share]);
    if (described === this.#shown) return;
    this.#shown = described;
    this.element.hidden = steps.length === 0;
    const done = (/** @type {number} */ rank) => (rank < now ? 1 : rank > now ? 0 : share);
    this.element.replaceChildren(
      ...steps.map((text, rank) =>
        make("li", { "--done": String(done(rank)), ...(rank === now ? { "aria-current": "step" } : {}) }, text),
      ),
    );
  }
}
