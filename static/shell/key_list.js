/** Dialog that lists the keys by area and changes them, and lists the marks, with a search field. */

import { button, byId, keyCaps, make } from "../widgets/elements.js";
import { fitness } from "../widgets/fuzzy.js";
import { keyOf, obeys } from "../widgets/key_matching.js";
import { markSection } from "../timeline/mark_list.js";

/**
 * @typedef {import("../widgets/key_matching.js").Binding} Binding
 */

/**
 * @param {Binding[]} table
 * @param {import("./key_choices.js").KeyChoices} choices
 */
export function mountKeyList(table, choices) {
  const dialog = byId("key-list", HTMLDialogElement);
  const queryField = byId("key-query", HTMLInputElement);
  const list = byId("key-areas", HTMLElement);
  const marks = byId("key-marks", HTMLElement);
  const none = byId("key-none", HTMLElement);
  /** Buttons of the commands that are listed. @type {Map<Binding, HTMLButtonElement>} */
  const buttons = new Map();
  /** Command whose key is asked for. @type {Binding | null} */
  let asked = null;
  choices.onChange(() => dialog.open && search());
  marks.append(markSection());
  queryField.addEventListener("input", () => search());
  button("show-key-list", () => show());
  const reset = button("reset-keys", () => void choices.reset());
  dialog.addEventListener("click", (event) => event.target === dialog && dialog.close());
  dialog.addEventListener("keydown", (event) => take(event), true);
  dialog.addEventListener("close", () => list.replaceChildren());
  list.addEventListener("focusout", () => cancel());

  function show() {
    queryField.value = "";
    search();
    dialog.showModal();
  }

  /** List the commands that have keys, and with a query those without keys too. */
  function search() {
    const query = queryField.value;
    /** @type {Map<string, HTMLElement>} */
    const areas = new Map();
    buttons.clear();
    for (const bindings of merged(table.filter(({ keys }) => keys.length > 0 || query.trim() !== ""))) {
      const { area = "More" } = bindings[0];
      const label = joined(bindings.map((one) => one.label));
      if (fitness(query, `${label} ${bindings.flatMap(({ keys }) => keys).join(" ")} ${area}`) === null) continue;
      const section = areas.get(area) ?? make("section", {}, make("h3", {}, area), make("dl"));
      areas.set(area, section);
      const labels = JSON.stringify(bindings.map((one) => one.label));
      section.lastChild?.appendChild(make("div", {}, make("dt", {}, ...bindings.map((one) => caps(one))), make("dd", { "data-labels": labels }, label)));
    }
    list.replaceChildren(...areas.values());
    for (const row of marks.querySelectorAll("dl > div")) row.toggleAttribute("hidden", fitness(query, `${row.textContent}`) === null);
    marks.hidden = marks.querySelector("dl > div:not([hidden])") === null;
    none.hidden = areas.size > 0 || !marks.hidden;
    reset.disabled = !choices.areChanged();
  }

  /** @param {Binding} binding */
  function caps(binding) {
    const { keys, label, matches } = binding;
    if (matches) return make("span", { title: "This key cannot be changed" }, keyCaps(keys));
    const title = `Change the key of “${label}”`;
    const name = `${title}: ${keys.join(", ") || "none"}`;
    const change = make("button", { type: "button", title, "aria-label": name, onclick: () => ask(binding) }, capsOf(binding));
    buttons.set(binding, change);
    return change;
  }

  /** @param {Binding} binding */
  function ask(binding) {
    cancel();
    asked = binding;
    buttons.get(binding)?.replaceChildren("Press a key");
    noteText(binding, "Esc cancels, Delete leaves it without a key");
  }

  function cancel() {
    if (!asked) return;
    buttons.get(asked)?.replaceChildren(capsOf(asked));
    list.querySelector("output")?.remove();
    asked = null;
  }

  /** @param {KeyboardEvent} event */
  async function take(event) {
    const binding = asked;
    if (!binding || ["Control", "Alt", "Shift", "Meta", "AltGraph"].includes(event.key)) return;
    event.preventDefault();
    event.stopPropagation();
    cancel();
    if (event.key === "Escape") return;
    const key = event.key === "Delete" ? null : keyOf(event);
    const owner = table.find((one) => one !== binding && obeys(one, event));
    let note = owner?.matches ? `“${owner.label}” keeps this key.` : "Expected a letter, a sign or a named key, found another.";
    if (event.key === "Delete" || (key !== null && !owner?.matches)) {
      note = (await choices.choose(binding, key)) || (owner && key ? `Taken from “${owner.label}”` : "");
    }
    noteText(binding, note);
  }

  /**
   * Show a sentence in the row of a command, and give its button the focus.
   *
   * @param {Binding} binding
   * @param {string} text
   */
  function noteText(binding, text) {
    list.querySelector("output")?.remove();
    const change = buttons.get(binding);
    change?.closest("div")?.lastChild?.appendChild(make("output", {}, text));
    change?.focus();
  }

  return { show };
}

/** @param {Binding} binding */
function capsOf({ keys }) {
  return keys.length > 0 ? keyCaps(keys) : make("span", "keys", "none");
}

/**
 * Merge neighbours with keys that differ in one word, such as *Next keyframe* and *Previous keyframe*, so that the list fits the screen.
 *
 * @param {Binding[]} bindings
 * @returns {Binding[][]}
 */
function merged(bindings) {
  /** @type {Binding[][]} */
  const rows = [];
  for (const binding of bindings) {
    const row = rows.at(-1);
    const words = row?.map(({ label }) => differingWord(label, binding.label)) ?? [null];
    if (row?.[0].keys.length && binding.keys.length && row[0].area === binding.area && words[0] !== null && new Set(words).size === 1) row.push(binding);
    else rows.push([binding]);
  }
  return rows;
}

/**
 * Position of the only word in which two labels differ; null if there is none.
 *
 * @param {string} one
 * @param {string} other
 */
function differingWord(one, other) {
  const [words, others] = [one.split(" "), other.split(" ")];
  if (words.length !== others.length || words.length < 2) return null;
  const differing = words.flatMap((word, index) => (word === others[index] ? [] : [index]));
  return differing.length === 1 ? differing[0] : null;
}

/** @param {string[]} labels that differ in one word at most */
function joined(labels) {
  if (labels.length === 1) return labels[0];
  const at = differingWord(labels[0], labels[1]) ?? 0;
  const words = labels.map((label) => label.split(" ")[at]).map((word, index) => (index > 0 && at === 0 ? word.toLowerCase() : word));
  const either = `${words.slice(0, -1).join(", ")} or ${words.at(-1)}`;
  return labels[0].split(" ").map((word, index) => (index === at ? either : word)).join(" ");
}
