/** Labels in the corners of a pane: camera, visibility of the selected joint, cost, scale and tools. */

import { make, textButton } from "../widgets/elements.js";
import { displayName, px } from "../widgets/text.js";

const SCALE_FROM_PX = 230;

/**
 * @typedef {"visible" | "hidden" | "outside"} Visibility
 */

/** Filled for visible joints, hollow for hidden ones, as the joints are drawn. */
const MARKS = { visible: "●", hidden: "○", outside: "⊘" };
const MEANINGS = {
  visible: "is visible in this view",
  hidden: "is occluded in this view",
  outside: "is outside this image",
};

export class PaneCorner {
  #label = make("div", "pane-label");
  #mark = make("span");
  #word = make("span");
  #joint = make("output", { className: "pane-joint", hidden: true });
  #cost = make("output", { className: "pane-cost", title: "Chamfer cost of this view, in pixels" });
  #tools = make("div", "pane-tools");
  #placeholder = make("div", { className: "pane-placeholder is-clipped", title: "The requested frame is loading. Until it arrives, the nearest available frame is shown", hidden: true });
  #scale = make("div", { className: "pane-scale", title: "Distance image: distance to the nearest edge, in image pixels", hidden: true });
  #limit = make("span");
  #fit;
  #tone;

  /**
   * @param {number} camera
   * @param {string} name
   * @param {{reset: () => void, openToneMenu: (button: HTMLElement) => void}} run
   */
  constructor(camera, name, { reset, openToneMenu }) {
    this.#joint.append(this.#mark, this.#word);
    this.#label.append(make("kbd", {}, String(camera + 1)), make("span", "pane-name", name), this.#joint);
    this.#label.title = `Camera ${camera + 1}, ${name}: press ${keysOf(camera)} or double-click to fill the grid`;

    this.#scale.append("0", make("i"), this.#limit);
    this.#fit = textButton("Whole", "Show the whole image (0)", reset, { className: "pane-reset", "aria-label": `Show the whole image of ${name}` });
    const adjust = "Brightness and contrast";
    this.#tone = make("button", { type: "button", className: "pane-tone", title: adjust, "aria-label": `${adjust} of ${name}` }, "◐");
    this.#tone.addEventListener("click", () => openToneMenu(this.#tone));
    this.#tools.append(this.#scale, this.#tone, this.#fit);
  }

  get elements() {
    return [this.#label, this.#cost, this.#placeholder, this.#tools];
  }

  get toneButton() {
    return this.#tone;
  }

  /** @param {number | null} cost in pixels */
  showCost(cost) {
    this.#cost.textContent = px(cost);
  }

  /** @param {import("../model/store.js").Placeholder | null} placeholder the frame that is shown and the frame that is loading */
  showPlaceholder(placeholder) {
    this.#placeholder.hidden = placeholder === null || placeholder.frame === placeholder.target;
    if (!placeholder) return;
    const word = make("span", {}, "frame "); // hidden in a narrow pane
    this.#placeholder.replaceChildren(word, `${placeholder.frame}, while ${placeholder.target} loads`);
  }

  /** @param {boolean} isReset whether the whole image is shown */
  showZoom(isReset) {
    this.#fit.hidden = isReset;
  }

  /** @param {boolean} isChanged whether the tone was changed */
  showTone(isChanged) {
    this.#tone.classList.toggle("is-changed", isChanged);
  }

  /**
   * @param {string | null} joint name of the selected joint
   * @param {Visibility} visibility
   * @param {string} [by] name of the other person who occludes it
   */
  showJoint(joint, visibility, by) {
    this.#joint.hidden = joint === null;
    if (joint === null || this.#joint.dataset.is === `${joint} ${visibility} ${by}`) return;
    this.#joint.dataset.is = `${joint} ${visibility} ${by}`;
    this.#mark.textContent = MARKS[visibility];
    this.#word.textContent = !by ? visibility : visibility === "hidden" ? `hidden by ${by}` : `behind ${by}`;
    const meaning = !by ? MEANINGS[visibility] : `is occluded by ${by}${visibility === "visible" ? ", who is dimmed" : ""}`;
    this.#joint.title = `The ${displayName(joint)} ${meaning}`;
  }

  /**
   * @param {number | null} limitPx distance of the darkest colour of the distance image; null if it is hidden
   * @param {number} paneWidth
   */
  showScale(limitPx, paneWidth) {
    this.#scale.hidden = limitPx === null || paneWidth < SCALE_FROM_PX;
    if (limitPx !== null) this.#limit.textContent = `${Math.round(limitPx)} px`;
  }
}

/** @param {number} camera */
function keysOf(camera) {
  return camera < 9 ? `${camera + 1}` : `${[...String(camera + 1)].join(" ")}`;
}
