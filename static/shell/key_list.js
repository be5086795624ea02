/** Dialog that lists the keys by area, and the marks, with a search field. */

import { button, byId, keyCaps } from "../widgets/elements.js";
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
    for (const { keys, label, area = "More" } of table.filter((binding) => binding.keys.length > 0)) {
      let section = areas.get(area);
      if (!section) {
        section = document.createElement("section");
        const heading = document.createElement("h3");
        heading.textContent = area;
        section.append(heading, document.createElement("dl"));
        areas.set(area, section);
      }
      const row = document.createElement("div");
      const [term, description] = [document.createElement("dt"), document.createElement("dd")];
      term.append(keyCaps(keys));
      description.textContent = label;
      row.append(term, description);
      section.querySelector("dl")?.append(row);
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
