/**
 * Tree of the search stages (GD96 Fig. 2) with a column per pass: degrees of freedom, bounds, steps, cost and gain of each
 * stage, and the running stage.
 */

import { byId, make, onChange } from "../widgets/elements.js";
import { selectedRun } from "../model/search_runs.js";
import { makeNumber } from "./search_widgets.js";
import { count, displayName } from "../widgets/text.js";

/**
 * @typedef {import("../model/protocol.js").SearchLeaf} SearchLeaf
 * @typedef {import("../model/protocol.js").SearchSetupMessage & import("../model/protocol.js").SearchValues} Setup
 */

const DEGREES = 180 / Math.PI;
const CENTIMETRES = 100;
/** @type {{key: "bound_rad" | "step_rad" | "bound_m" | "step_m", has: "angles" | "lengths", head: string, unit: number, title: string}[]} */
const FIELDS = [
  { key: "bound_rad", has: "angles", head: "± °", unit: DEGREES, title: "Bound: largest change of an angle, degrees" },
  { key: "step_rad", has: "angles", head: "step °", unit: DEGREES, title: "Step: spacing of the poses tried, degrees" },
  { key: "bound_m", has: "lengths", head: "± cm", unit: CENTIMETRES, title: "Bound: largest change of a position, cm" },
  { key: "step_m", has: "lengths", head: "step cm", unit: CENTIMETRES, title: "Step: spacing of the positions tried, cm" },
];

/**
 * @param {import("../model/store.js").Store} store
 * @param {(changes: Record<string, unknown>) => void} change
 */
export function mountSearchTree(store, change) {
  const element = byId("search-tree", HTMLElement);
  /** The shape that the tree was built for. */
  let built = "";
  /** @type {Map<string, HTMLElement>} cells by person, stage and pass */
  const cells = new Map();
  /** @type {{field: ReturnType<typeof makeNumber>, read: (setup: Setup) => number | null}[]} */
  let rowFields = [];

  store.onTab("search", ["searchSetup", "settings", "session"], () => {
    const { searchSetup, settings, session } = store.facts;
    if (searchSetup && settings && session) build({ ...settings.search, ...searchSetup }, session);
  });
  store.onTab("search", ["searchSetup", "settings", "session", "searchRuns", "searchRun"], showRun);

  /**
   * @param {Setup} setup
   * @param {import("../model/protocol.js").SessionMessage} session
   */
  function build(setup, session) {
    const shape = JSON.stringify([setup.leaves.map(({ person, name, dofs }) => [person, name, dofs]), setup.passes]);
    if (shape !== built) {
      built = shape;
      cells.clear();
      rowFields = [];
      const table = make("div", { className: "tree-table", "--passes": String(setup.passes.length) }, ...head(setup));
      session.people.forEach((person, index) => {
        const leaves = setup.leaves.filter((leaf) => leaf.person === index);
        const dofs = leaves.reduce((sum, leaf) => sum + leaf.dofs.length, 0);
        table.append(...root(setup, person.name, dofs, index));
        leaves.forEach((leaf, i) => table.append(...row(setup, leaf, i === leaves.length - 1)));
      });
      element.replaceChildren(table, rest(setup));
    }
    for (const { field, read } of rowFields) field.show(read(setup));
    for (const mark of /** @type {NodeListOf<HTMLElement>} */ (element.querySelectorAll("[data-leaf]"))) {
      const leaf = setup.leaves.find(({ person, name }) => mark.dataset.leaf === `${person} ${name}`);
      mark.classList.toggle("is-own", !!leaf?.own);
    }
  }

  /** @param {Setup} setup */
  function head(setup) {
    const passes = setup.passes.map((factor) => {
      const title = `Pass with steps ×${factor}: poses evaluated and reduction of the cost`;
      return cell("tree-head is-clipped", `steps ×${factor}`, title);
    });
    return [
      cell("tree-head is-clipped", "Stage", "Groups of degrees of freedom, searched one after the other"),
      cell("tree-head is-clipped", "DOF", "Number of degrees of freedom searched together"),
      ...FIELDS.map(({ head, title }) => cell("tree-head is-clipped", head, title)),
      ...passes,
    ];
  }

  /**
   * Root row of a person. The root of the first person has the default bounds and steps.
   *
   * @param {Setup} setup
   * @param {string} name
   * @param {number} dofs
   * @param {number} person
   */
  function root(setup, name, dofs, person) {
    const fields = FIELDS.map(({ key, unit, title }) => {
      if (person > 0) return cell("", "", "");
      const field = makeNumber("", `${title}. Default for all stages`, (value) => value !== null && change({ [key]: value / unit }));
      rowFields.push({ field, read: (now) => now[key] * unit });
      return field.element;
    });
    return [
      cell("tree-name is-clipped", name, `${name}: ${dofs} degrees of freedom`),
      cell("tree-count", String(dofs), `${dofs} degrees of freedom`),
      ...fields,
      ...setup.passes.map(() => cell("", "", "")),
    ];
  }

  /**
   * @param {Setup} setup
   * @param {SearchLeaf} leaf
   * @param {boolean} isLast
   */
  function row(setup, leaf, isLast) {
    const { person, name, dofs } = leaf;
    const list = dofs.map((dof) => displayName(dof).replace(".", " ")).join(", ");
    const label = cell(`tree-name is-clipped is-leaf${isLast ? " is-last" : ""}`, name, `${name}: ${list}`);
    label.dataset.leaf = `${person} ${name}`;
    const fields = FIELDS.map(({ key, has, unit, title }) => {
      if (leaf[has] === 0) return cell("", "", "");
      const set = (/** @type {number | null} */ value) => change({ leaf: { person, name, [key]: value === null ? null : value / unit } });
      const field = makeNumber("", `${title}, for ${name}. Empty: default`, set, "mixed");
      rowFields.push({ field, read: (now) => valueOf(now, person, name, key, unit) });
      return field.element;
    });
    const passes = setup.passes.map((factor) => {
      const one = cell("tree-pass", "", "");
      cells.set(`${person} ${name} ${factor}`, one);
      return one;
    });
    return [label, cell("tree-count", String(dofs.length), list), ...fields, ...passes];
  }

  /**
   * Settings of all stages.
   *
   * @param {Setup} setup
   */
  function rest(setup) {
    const line = make("div", "tree-rest");
    const whole = (/** @type {"patience" | "max_expansions"} */ key, /** @type {string} */ label, /** @type {string} */ title) => {
      const field = makeNumber(label, title, (value) => value !== null && change({ [key]: Math.round(value) }));
      rowFields.push({ field, read: (now) => now[key] });
      return field.element;
    };
    const patience = whole("patience", "Patience", "A stage ends after this many expansions without improvement");
    const max = whole("max_expansions", "Max.", "Maximum number of expansions per stage");
    const passes = make("label", { className: "search-field", title: "Step factors: all stages are searched once per factor. The paper uses 1" });
    const text = make("input", { type: "text", value: setup.passes.join(" "), "aria-label": passes.title });
    text.addEventListener("change", () => {
      const factors = text.value.split(/[\s,;]+/).filter(Boolean).map(Number);
      change({ passes: factors.map((factor) => (Number.isFinite(factor) ? factor : 0)) });
      text.value = store.facts.settings?.search.passes.join(" ") ?? "";
    });
    text.addEventListener("keydown", (event) => event.stopPropagation());
    passes.append("Passes", text);
    const apart = make("label", { className: "search-field", title: "Search the limbs of a group separately, not together as in the paper" });
    const box = make("input", { type: "checkbox", checked: setup.limbs_apart });
    onChange(box, () => change({ limbs_apart: box.checked }));
    apart.append(box, "separate limbs");
    line.append(passes, patience, max, apart);
    return line;
  }

  function showRun() {
    const run = selectedRun(store.facts);
    const stages = new Map(run?.stages.map((stage) => [`${stage.person} ${stage.name} ${stage.factor}`, stage]));
    for (const [key, element] of cells) {
      const stage = stages.get(key);
      const isBegun = !!stage && stage.evaluations > 0;
      const text = stage?.done || isBegun ? `${count(stage.evaluations)} · −${stage.gain_px.toFixed(2)}` : "";
      if (element.textContent !== text) element.textContent = text;
      element.classList.toggle("is-done", !!stage?.done);
      element.classList.toggle("is-running", !!stage?.running);
      element.title = stage && text ? describe(stage) : "Not searched";
    }
  }
}

/** @param {import("../model/protocol.js").SearchStage} stage */
function describe({ name, factor, evaluations, gain_px, running }) {
  const figures = `${count(evaluations)} poses evaluated, cost reduced by ${gain_px.toFixed(3)} px`;
  return `${name}, steps ×${factor}: ${figures}${running ? "; running" : ""}`;
}

/**
 * @param {string} className
 * @param {string} text
 * @param {string} title
 */
function cell(className, text, title) {
  return make("div", { className, title }, text);
}

/**
 * @param {Setup} setup
 * @param {number} person
 * @param {string} name
 * @param {"bound_rad" | "step_rad" | "bound_m" | "step_m"} key
 * @param {number} unit
 */
function valueOf(setup, person, name, key, unit) {
  const value = setup.leaves.find((leaf) => leaf.person === person && leaf.name === name)?.[key] ?? null;
  return value === null ? null : value * unit;
}
