/** Settings of the search that hold for all stages. The search drawer has those of single stages. */

import { make, textButton } from "../widgets/elements.js";
import { checkRow, choiceRow, numberRow, textRow } from "./rows.js";

/** @typedef {import("../model/protocol.js").SearchValues} SearchValues */

const DEGREES = 180 / Math.PI;
const CENTIMETRES = 100;

/** @typedef {"bound_rad" | "step_rad" | "bound_m" | "step_m" | "patience" | "max_expansions"} NumberName */

/** @type {{name: NumberName, label: string, unit: string, factor: number, low: number, high: number, step: number, title: string}[]} */
const NUMBERS = [
  {
    name: "bound_rad", label: "Angle bound", unit: "°", factor: DEGREES, low: 0.5, high: 90, step: 1,
    title: "Largest change of an angle from the start of the search, degrees",
  },
  {
    name: "step_rad", label: "Angle step", unit: "°", factor: DEGREES, low: 0.5, high: 30, step: 0.5,
    title: "Spacing of the poses tried, along an angle, degrees",
  },
  {
    name: "bound_m", label: "Position bound", unit: "cm", factor: CENTIMETRES, low: 0.5, high: 100, step: 1,
    title: "Largest change of the position from the start of the search, centimetres",
  },
  {
    name: "step_m", label: "Position step", unit: "cm", factor: CENTIMETRES, low: 0.5, high: 30, step: 0.5,
    title: "Spacing of the poses tried, along the position, centimetres",
  },
  {
    name: "patience", label: "Patience", unit: "", factor: 1, low: 1, high: 100, step: 1,
    title: "A stage ends after this many expansions without improvement. An expansion scores the neighbours of the best pose",
  },
  {
    name: "max_expansions", label: "Max. expansions", unit: "", factor: 1, low: 1, high: 10000, step: 10,
    title: "Largest number of expansions of a stage",
  },
]; // prettier-ignore

/**
 * @param {import("../model/index.js").Context} context
 * @returns {import("./inspector.js").Section}
 */
export function searchSection({ store, send, say: refuse }) {
  const set = (/** @type {Partial<SearchValues>} */ changes) =>
    send({ type: "search_settings", changes: /** @type {import("../model/protocol.js").SearchChanges} */ (changes) });
  const numbers = NUMBERS.map(({ name, label, title, factor, ...options }) => {
    const change = (/** @type {number | null} */ value) => value !== null && set({ [name]: factor === 1 ? Math.round(value) : value / factor });
    return { name, factor, row: numberRow(label, title, { ...options, change, refuse }) };
  });
  const takePasses = (/** @type {string} */ text) => {
    const factors = text.split(/[\s,;]+/).filter(Boolean).map(Number);
    if (!factors.length || !factors.every((factor) => factor > 0 && factor <= 1)) {
      return `Passes: expected factors above 0 and up to 1, such as 1 0.5 0.25, found “${text}”.`;
    }
    set({ passes: factors });
    return null;
  };
  const repeating = "Factors on the steps: all stages are searched once per factor, each time around the best pose so far. GD96 has one pass, 1";
  const passes = textRow("Passes", repeating, takePasses, refuse);
  const limiting = "Edges farther than this from a contour add nothing more to the cost, pixels. Empty: 3% of the longer side of the image";
  const theta = numberRow("Outlier distance θ", limiting, {
    unit: "px",
    low: 1,
    high: 500,
    step: 1,
    auto: "auto",
    change: (value) => set({ theta_px: value }),
    refuse,
  });
  const counting = "Contour points beyond θ count with θ (truncated), or are left out of the mean as in GD96 (paper)";
  const outliers = choiceRow("Outliers", counting, { truncated: "Truncated", paper: "Left out (GD96)" }, (value) => set({ outliers: value }));
  const separating = "Search the limbs of a group one after the other, not together as in GD96";
  const apart = checkRow("Separate limbs", separating, (on) => set({ limbs_apart: on }));
  const reset = textButton("Reset", "Restore the default search settings. Bounds and steps of single stages stay", () => {
    const { settings } = store.facts;
    if (settings) set(settings.search_default);
  });
  const note = make("p", "section-note", "The search drawer has bounds and steps of single stages.");
  const body = make("div", {}, ...numbers.map(({ row }) => row.element), passes.element, theta.element, outliers.element, apart.element, note, reset);

  const show = () => {
    const { settings } = store.facts;
    if (!settings) return;
    const { search, search_default: initial } = settings;
    for (const { name, factor, row } of numbers) row.show(search[name] * factor, search[name] !== initial[name]);
    passes.show(search.passes.join(" "), search.passes.join() !== initial.passes.join());
    theta.show(search.theta_px, search.theta_px !== initial.theta_px);
    outliers.show(search.outliers, search.outliers !== initial.outliers);
    apart.show(search.limbs_apart, search.limbs_apart !== initial.limbs_apart);
    reset.disabled = JSON.stringify(search) === JSON.stringify(initial);
  };
  store.on(["settings"], show);
  return { id: "search", title: "Search settings", hint: "How the search of a frame chooses the poses that it tries", body };
}
