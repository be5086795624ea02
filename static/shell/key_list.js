/** Dialog that lists the keys by area, and the marks, with a search field. */

import { button, byId, keyCaps, make } from "../widgets/elements.js";
import { fitness } from "../widgets/fuzzy.js";
import { markSection } from "../timeline/mark_list.js";

export class KeyList {
  #dialog = byId("key-list", HTMLDialogElement);
  #query = byId("key-query", HTMLInputElement);
  #list = byId("key-areas", HTMLElement);
  #marks = byId("key-marks", HTMLElement);
  #none = byId("key-none", HTMLElement);

  constructor() {
    this.#marks.append(markSection());
    this.#query.addEventListener("input", () => this.#search());
    button("show-key-list", () => this.show());
    this.#dialog.addEventListener("click", (event) => event.target === this.#dialog && this.#dialog.close());
  }

  /** @param {import("../widgets/key_matching.js").Binding[]} table */
  setBindings(table) {
    /** @type {Map<string, HTMLElement>} */
    const areas = new Map();
    for (const { keys, label, labels, area } of merged(table.filter((binding) => binding.keys.length > 0))) {
      let section = areas.get(area);
      if (!section) {
        section = make("section", {}, make("h3", {}, area), make("dl"));
        areas.set(area, section);
      }
      const description = make("dd", { "data-labels": JSON.stringify(labels) }, label);
      section.querySelector("dl")?.append(make("div", {}, make("dt", {}, keyCaps(keys)), description));
    }
    this.#list.replaceChildren(...areas.values());
  }

  show() {
    this.#query.value = "";
    this.#search();
    this.#dialog.showModal();
  }

  #search() {
    const query = this.#query.value;
    for (const section of [...this.#list.children, ...this.#marks.children]) {
      const area = section.querySelector("h3")?.textContent ?? "";
      let some = false;
      for (const row of section.querySelectorAll("dl > div")) {
        const fits = fitness(query, `${row.textContent} ${area}`) !== null;
        /** @type {HTMLElement} */ (row).hidden = !fits;
        some ||= fits;
      }
      /** @type {HTMLElement} */ (section).hidden = !some;
    }
    this.#none.hidden = [this.#list, this.#marks].some((one) => one.querySelector("section:not([hidden])") !== null);
  }
}

/**
 * Merge neighbours that differ in one word, such as *Next keyframe* and *Previous keyframe*, so that the list fits the screen.
 *
 * @param {import("../widgets/key_matching.js").Binding[]} bindings
 * @returns {{keys: string[], label: string, labels: string[], area: string}[]}
 */
function merged(bindings) {
  /** @type {{keys: string[], labels: string[], area: string, at: number | null}[]} at: position of the word that differs */
  const rows = [];
  for (const { keys, label, area = "More" } of bindings) {
    const row = rows.at(-1);
    const at = row && row.area === area ? differingWord(row.labels[0], label) : null;
    if (row && at !== null && (row.at === null || row.at === at)) {
      row.at = at;
      row.labels.push(label);
      row.keys.push(...keys);
    } else rows.push({ keys: [...keys], labels: [label], area, at: null });
  }
  return rows.map(({ keys, labels, area, at }) => ({ keys, labels, area, label: at === null ? labels[0] : joined(labels, at) }));
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

/**
 * @param {string[]} labels
 * @param {number} at position of the word that differs
 */
function joined(labels, at) {
  const words = labels.map((label) => label.split(" ")[at]).map((word, index) => (index > 0 && at === 0 ? word.toLowerCase() : word));
  const all = `${words.slice(0, -1).join(", ")} or ${words.at(-1)}`;
  return labels[0]
    .split(" ")
    .map((word, index) => (index === at ? all : word))
    .join(" ");
}
