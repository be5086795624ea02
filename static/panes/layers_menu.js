/** Popover of all layers, and switches of the most important ones in the top bar. */

import { byId, checkbox, make, onChange } from "../widgets/elements.js";
import { LAYERS } from "../model/layers.js";
import { opensPopover, slider, togglePopover } from "../widgets/popovers.js";

/** @typedef {import("../model/protocol.js").Layer} Layer */

/** @type {{label: string, title: string, ids: Layer[]}[]} */
const QUICK = [
  { label: "Contours", title: "Contours of the model, solid and dashed", ids: ["contours"] },
  { label: "Joints", title: "Joints, which can be dragged", ids: ["joints"] },
  { label: "Edges", title: "Image edges: explained by the pose (turquoise) or not (pink)", ids: ["accepted", "rejected"] },
  { label: "Distance", title: "Distance to the nearest edge, which the search minimizes", ids: ["distance"] },
];
const GROUPS = ["Model", "Evidence", "Picture"];

/** @typedef {ReturnType<typeof mountLayersMenu>} LayersMenu */

/**
 * @param {import("../model/store.js").Store} store
 * @param {import("../model/layers.js").Layers} layers
 */
export function mountLayersMenu(store, layers) {
  const panel = byId("layers-menu", HTMLElement);
  const button = byId("show-layers", HTMLButtonElement);
  /** @type {(() => void)[]} */
  const refreshers = [];
  opensPopover(panel, button, () => toggle());
  buildQuick();
  for (const group of GROUPS) buildGroup(group);
  buildFoot();
  const show = () => refreshers.forEach((one) => one());
  store.on(["layers"], () => show());
  show();

  function toggle() {
    togglePopover(panel, button);
  }

  function buildQuick() {
    const bar = byId("quick-layers", HTMLElement);
    for (const { label, title, ids } of QUICK) {
      const { element, input } = checkbox(label, title);
      onChange(input, () => layers.toggle(ids, input.checked));
      refreshers.push(() => {
        const { shown } = store.facts.layers;
        input.checked = ids.some((id) => shown[id]);
        input.indeterminate = input.checked && !ids.every((id) => shown[id]);
      });
      bar.append(element);
    }
  }

  /** @param {string} group */
  function buildGroup(group) {
    panel.append(make("h3", {}, group));
    // In painting order, topmost first.
    for (const info of LAYERS.filter((layer) => layer.group === group).reverse()) {
      panel.append(...row(info));
      if (info.id === "contours") panel.append(colors());
    }
  }

  /** @param {import("../model/layers.js").LayerInfo} info */
  function row({ id, label, title }) {
    const { element, input } = checkbox(label, title);
    element.className = "popover-check";
    input.dataset.layer = id;
    input.addEventListener("change", () => layers.toggle([id], input.checked));
    const opacity = slider({
      label: `Opacity of ${label.toLowerCase()}`,
      title: `Opacity of ${label.toLowerCase()}`,
      min: 5,
      max: 100,
      step: 5,
      format: (value) => `${value}%`,
      onInput: (value) => layers.setOpacity(id, value / 100),
    });
    opacity.input.dataset.opacity = id;
    refreshers.push(() => {
      const { layers } = store.facts;
      input.checked = layers.shown[id];
      opacity.show(Math.round(100 * layers.opacity[id]));
      opacity.input.disabled = !layers.shown[id];
      opacity.value.classList.toggle("is-off", !layers.shown[id]);
    });
    return [element, opacity.input, opacity.value];
  }

  function colors() {
    const choice = make("fieldset", { className: "segmented popover-choice", "aria-label": "Colours of the contours" });
    for (const [value, label, title] of /** @type {const} */ ([
      ["person", "by person", "Colour contours by person"],
      ["part", "by part", "Colour contours by body part"],
    ])) {
      const { element, input } = checkbox(label, title, { type: "radio", name: "contour-colors", value });
      input.addEventListener("change", () => layers.setColors(value));
      refreshers.push(() => (input.checked = store.facts.layers.colors === value));
      choice.append(element);
    }
    return choice;
  }

  function buildFoot() {
    const reset = make("button", { type: "button", id: "reset-layers", title: "Restore the default layers and opacities", onclick: () => layers.reset() }, "Reset layers");
    panel.append(make("div", "popover-foot", make("span", {}, "Saved in this browser for this session"), reset));
  }

  return { toggle };
}
