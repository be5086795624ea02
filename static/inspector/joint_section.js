/** Degrees of freedom of the selected joint, with sliders over their limits. */

import { make } from "../widgets/elements.js";
import { ofDof } from "../model/observability.js";
import { meaning } from "../posing/dof_names.js";
import { capital, displayName } from "../widgets/text.js";
import { costMap } from "./cost_map.js";
import { boundedField } from "./rows.js";

const UNITS = { deg: "°", cm: "cm" };
/** Range of the slider of an angle without limits, degrees. */
const FULL_TURN = { low: -180, high: 180 };
const MAX_CM = 1e5;
/** @typedef {{dof: number, field: ReturnType<typeof boundedField>, slider: HTMLInputElement | null, element: HTMLElement, title: string}} Row */

/**
 * @param {import("../model/index.js").Context} context
 * @param {import("../posing/index.js").PosingRoom} room
 * @returns {import("./inspector.js").Section & {openMap: () => void}}
 */
export function jointSection(context, { posing }) {
  const { store, say: refuse } = context;
  const body = make("div");
  const expectedError = make("p", { className: "section-note", title: "Root mean square error of the joint that tracking expects. The layer Error ellipses draws it in the views" });
  const map = costMap(context, posing);
  /** @type {Row[]} */
  let rows = [];
  let built = "";

  /**
   * @param {import("../model/protocol.js").DofInfo} info
   * @param {number} dof
   * @returns {Row}
   */
  const makeRow = (info, dof) => {
    const element = make("label", "row is-joint");
    const unit = UNITS[info.unit];
    const limits = info.low === null || info.high === null ? "no limits" : `from ${info.low} to ${info.high} ${unit}`;
    const effect = meaning(info);
    const title = `${displayName(info.joint)} ${info.name}${effect && `: ${effect}`}; ${limits}`;
    const head = make("span", "row-label is-clipped", capital(info.name));
    const [low, high] = info.unit === "cm" ? [-MAX_CM, MAX_CM] : [info.low ?? -360, info.high ?? 360];
    const field = boundedField({
      name: `${displayName(info.joint)} ${info.name}, ${unit}`,
      low: low - 0.05,
      high: high + 0.05,
      step: () => posing.steps[info.unit],
      change: (value) => value !== null && posing.set(dof, value),
      refuse,
    });
    element.append(head, field.element, make("span", "row-unit", unit));
    const range = info.low === null || info.high === null ? FULL_TURN : { low: info.low, high: info.high };
    const properties = { type: "range", min: String(range.low), max: String(range.high), step: "0.5", "aria-label": `${displayName(info.joint)} ${info.name}` };
    const slider = info.unit === "deg" ? make("input", properties) : null;
    if (slider) {
      slider.addEventListener("input", () => posing.slide(dof, Number(slider.value)));
      element.append(slider);
    }
    return { dof, field, slider, element, title };
  };

  const show = () => {
    const { person, point, dofs } = posing.joint();
    const { state } = store.facts;
    if (!person || !state || !point) return;
    const shape = JSON.stringify([state.person, point, dofs]);
    if (shape !== built) {
      built = shape;
      const title = make("p", "section-note", dofs.length ? capital(displayName(point)) : `The ${displayName(point)} has no angles of its own; drag it in a view.`);
      rows = dofs.map((dof) => makeRow(person.dofs[dof], dof));
      body.replaceChildren(title, expectedError, ...rows.map(({ element }) => element), map.element);
    }
    map.update();
    const error_m = state.expected_errors_m[person.points.indexOf(point)];
    expectedError.hidden = error_m === undefined;
    expectedError.textContent = `Expected error ${Math.round(1000 * error_m)} mm`;
    for (const { dof, field, slider, element, title } of rows) {
      const observed = ofDof(store.facts, dof);
      element.title = observed ? `${title}\n${observed.sentence}` : title;
      element.dataset.observed = observed?.level ?? "";
      const value = Math.round(10 * (state.dofs[dof] ?? 0)) / 10;
      const isLocked = state.locked.includes(dof);
      field.show(value);
      field.element.disabled = isLocked;
      if (!slider) continue;
      slider.disabled = isLocked;
      if (document.activeElement !== slider || !slider.matches(":active")) slider.value = String(value);
    }
  };
  store.on(["connected"], () => map.update(true));
  store.on(["state", "session", "observability", "layers", "costMap", "theme"], show);
  return { id: "joint", title: "Joint", hint: "Angles of the selected joint (J selects the next one)", body, openMap: map.open };
}
