/** Inspector: a column with collapsible sections beside the views. Open sections are stored. */

import { stored } from "../widgets/stored.js";
import { button, byId, make } from "../widgets/elements.js";

const STORED = "quadrille.inspector";

/**
 * @typedef {object} Section
 * @property {string} id
 * @property {string} title
 * @property {string} hint what it is for
 * @property {HTMLElement} body
 * @property {(reveal: () => void) => import("../widgets/key_matching.js").Command[]} [bindings] commands; `reveal` opens the section
 */

export class Inspector {
  #column = byId("inspector", HTMLElement);
  #button;
  /** @type {Map<string, {section: Section, fold: HTMLDetailsElement}>} */
  #sections = new Map();
  #stored = restored();

  /**
   * @param {import("../model/store.js").Store} store
   * @param {Section[]} sections from top to bottom
   */
  constructor(store, sections) {
    this.#button = button("show-inspector", () => this.toggle());
    for (const section of sections) this.add(section);
    this.#show();
    store.on(["connected"], () => (this.#column.inert = !store.facts.connected));
  }

  toggle() {
    this.#stored.open = !this.#stored.open;
    this.#show();
    this.#keep();
  }

  /**
   * Open a section and focus a control of it.
   *
   * @param {string} id
   * @param {HTMLElement} [row] by default the first one
   */
  reveal(id, row) {
    const found = this.#sections.get(id);
    if (!found) return;
    this.#stored.open = true;
    found.fold.open = true;
    this.#show();
    this.#keep();
    const target = row ?? found.section.body;
    (row ?? found.fold).scrollIntoView({ block: "nearest" });
    /** @type {HTMLElement | null} */ (target.querySelector("input:enabled, select:enabled, button:enabled"))?.focus();
  }

  /** One command for each section and each row, which opens it; none changes anything. */
  commands() {
    return [...this.#sections.values()].flatMap(({ section }) => {
      const rows = /** @type {HTMLElement[]} */ ([...section.body.querySelectorAll(".row:not([hidden])")]);
      return rows.map((row) => {
        const label = row.querySelector(".row-label")?.textContent ?? "";
        return { area: section.title, label, words: `${row.title} setting`, run: () => this.reveal(section.id, row) };
      });
    });
  }

  /**
   * @param {Section} section
   * @param {string} [before] the section that it stands above; at the end without one
   */
  add(section, before) {
    const fold = make("details", { className: "section", "data-section": section.id, open: this.#stored.sections.includes(section.id) });
    section.body.classList.add("section-body");
    fold.append(make("summary", { title: section.hint }, section.title), section.body);
    fold.addEventListener("toggle", () => this.#keep());
    this.#column.insertBefore(fold, (before && this.#sections.get(before)?.fold) || null);
    this.#sections.set(section.id, { section, fold });
  }

  #show() {
    this.#column.hidden = !this.#stored.open;
    this.#button.setAttribute("aria-pressed", String(this.#stored.open));
  }

  #keep() {
    this.#stored.sections = [...this.#sections].filter(([, { fold }]) => fold.open).map(([id]) => id);
    localStorage.setItem(STORED, JSON.stringify(this.#stored));
  }
}

/** @returns {{open: boolean, sections: string[]}} */
function restored() {
  const found = stored(STORED);
  return Array.isArray(found?.sections) ? { open: found.open === true, sections: found.sections } : { open: false, sections: ["body"] };
}
