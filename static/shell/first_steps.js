/** Card with the first steps, shown until the user closes it. The palette can show it again. */

import { button, byId } from "../widgets/elements.js";

const STORED = "quadrille.first_steps";

export class FirstSteps {
  #card = byId("first-steps", HTMLElement);

  /** @param {import("../model/store.js").Store} store */
  constructor(store) {
    button("close-first-steps", () => this.#close());
    this.#card.addEventListener("keydown", (event) => {
      if (event.key !== "Escape") return;
      event.preventDefault();
      this.#close();
    });
    store.subscribe((changed) => {
      if (!changed.has("session")) return;
      const isAlone = (store.facts.session?.people.length ?? 1) < 2;
      byId("first-choose-person", HTMLElement).hidden = isAlone;
      if (localStorage.getItem(STORED) !== "seen") this.#card.hidden = false;
    });
  }

  /** Show the card and focus its button. */
  show() {
    this.#card.hidden = false;
    byId("close-first-steps", HTMLButtonElement).focus();
  }

  #close() {
    localStorage.setItem(STORED, "seen");
    this.#card.hidden = true;
  }
}
