/** Labels in the corners of a pane: camera, visibility of the selected joint, cost, scale and tools. */

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
  #label = document.createElement("div");
  #mark = document.createElement("span");
  #word = document.createElement("span");
  #joint = document.createElement("output");
  #cost = document.createElement("output");
  #tools = document.createElement("div");
  #placeholder = document.createElement("div");
  #scale = document.createElement("div");
  #limit = document.createElement("span");
  #fit;
  #tone;

  /**
   * @param {number} camera
   * @param {string} name
   * @param {{reset: () => void, openToneMenu: (button: HTMLElement) => void}} run
   */
  constructor(camera, name, { reset, openToneMenu }) {
    this.#label.className = "pane-label";
    const number = document.createElement("kbd");
    number.textContent = String(camera + 1);
    const title = document.createElement("span");
    title.className = "pane-name";
    title.textContent = name;
    this.#joint.className = "pane-joint";
    this.#joint.append(this.#mark, this.#word);
    this.#joint.hidden = true;
    this.#label.append(number, title, this.#joint);
    this.#label.title = `Camera ${camera + 1}, ${name}: press ${keysOf(camera)} or double-click to fill the grid`;

    this.#cost.className = "pane-cost";
    this.#cost.title = "Chamfer cost of this view, in pixels";

    this.#placeholder.className = "pane-placeholder";
    this.#placeholder.title = "The requested frame is loading. Until it arrives, the nearest available frame is shown";
    this.#placeholder.hidden = true;

    this.#scale.className = "pane-scale";
    const bar = document.createElement("i");
    this.#scale.append("0", bar, this.#limit);
    this.#scale.title = "Distance image: distance to the nearest edge, in image pixels";
    this.#scale.hidden = true;
    this.#fit = toolButton("Whole", "Show the whole image (0)", `Show the whole image of ${name}`);
    this.#fit.classList.add("pane-reset");
    this.#fit.addEventListener("click", () => {
      this.#fit.blur();
      reset();
    });
    this.#tone = toolButton("◐", "Brightness and contrast (I)", `Brightness and contrast of ${name}`);
    this.#tone.classList.add("pane-tone");
    this.#tone.addEventListener("click", () => openToneMenu(this.#tone));
    this.#tools.className = "pane-tools";
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
    const word = document.createElement("span"); // hidden in a narrow pane
    word.textContent = "frame ";
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

/**
 * @param {string} text
 * @param {string} title
 * @param {string} name for screen readers
 */
function toolButton(text, title, name) {
  const button = document.createElement("button");
  button.type = "button";
  button.textContent = text;
  button.title = title;
  button.setAttribute("aria-label", name);
  return button;
}
