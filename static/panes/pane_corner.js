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

/** @typedef {ReturnType<typeof makePaneCorner>} PaneCorner */

/**
 * @param {number} camera
 * @param {string} name
 * @param {{reset: () => void, openToneMenu: (button: HTMLElement) => void}} run
 */
export function makePaneCorner(camera, name, { reset, openToneMenu }) {
  const [mark, word, limit] = [make("span"), make("span"), make("span")];
  const jointBadge = make("output", { className: "pane-joint", hidden: true }, mark, word);
  const title = `Camera ${camera + 1}, ${name}: press ${keysOf(camera)} or double-click to fill the grid`;
  const label = make("div", { className: "pane-label", title }, make("kbd", {}, String(camera + 1)), make("span", "pane-name", name), jointBadge);
  const costText = make("output", { className: "pane-cost", title: "Chamfer cost of this view, in pixels" });
  const loading = make("div", { className: "pane-placeholder is-clipped", title: "The requested frame is loading. Until it arrives, the nearest available frame is shown", hidden: true });
  const scale = make("div", { className: "pane-scale", title: "Distance image: distance to the nearest edge, in image pixels", hidden: true }, "0", make("i"), limit);
  const fit = textButton("Whole", "Show the whole image (0)", reset, { className: "pane-reset", "aria-label": `Show the whole image of ${name}` });
  const adjust = "Brightness and contrast";
  const tone = make("button", { type: "button", className: "pane-tone", title: adjust, "aria-label": `${adjust} of ${name}` }, "◐");
  tone.addEventListener("click", () => openToneMenu(tone));

  return {
    elements: [label, costText, loading, make("div", "pane-tools", scale, tone, fit)],
    toneButton: tone,

    /** @param {number | null} cost in pixels */
    showCost: (cost) => (costText.textContent = px(cost)),

    /** @param {import("../model/store.js").Placeholder | null} placeholder the frame that is shown and the frame that is loading */
    showPlaceholder(placeholder) {
      loading.hidden = placeholder === null || placeholder.frame === placeholder.target;
      if (!placeholder) return;
      const word = make("span", {}, "frame "); // hidden in a narrow pane
      loading.replaceChildren(word, `${placeholder.frame}, while ${placeholder.target} loads`);
    },

    /** @param {boolean} isReset whether the whole image is shown */
    showZoom: (isReset) => (fit.hidden = isReset),

    /** @param {boolean} isChanged whether the tone was changed */
    showTone: (isChanged) => tone.classList.toggle("is-changed", isChanged),

    /**
     * @param {string | null} joint name of the selected joint
     * @param {Visibility} visibility
     * @param {string} [by] name of the other person who occludes it
     */
    showJoint(joint, visibility, by) {
      jointBadge.hidden = joint === null;
      if (joint === null || jointBadge.dataset.is === `${joint} ${visibility} ${by}`) return;
      jointBadge.dataset.is = `${joint} ${visibility} ${by}`;
      mark.textContent = MARKS[visibility];
      word.textContent = !by ? visibility : visibility === "hidden" ? `hidden by ${by}` : `behind ${by}`;
      const meaning = !by ? MEANINGS[visibility] : `is occluded by ${by}${visibility === "visible" ? ", who is dimmed" : ""}`;
      jointBadge.title = `The ${displayName(joint)} ${meaning}`;
    },

    /**
     * @param {number | null} limitPx distance of the darkest colour of the distance image; null if it is hidden
     * @param {number} paneWidth
     */
    showScale(limitPx, paneWidth) {
      scale.hidden = limitPx === null || paneWidth < SCALE_FROM_PX;
      if (limitPx !== null) limit.textContent = `${Math.round(limitPx)} px`;
    },
  };
}

/** @param {number} camera */
function keysOf(camera) {
  return camera < 9 ? `${camera + 1}` : `${[...String(camera + 1)].join(" ")}`;
}
