/** Colour scheme of the page: dark, light, or that of the system. Stored in the browser. */

const STORED = "quadrille.theme";

/** @typedef {"system" | "dark" | "light"} ThemeChoice */

export class Themes {
  #store;
  #dark = matchMedia("(prefers-color-scheme: dark)");

  /** @param {import("./store.js").Store} store */
  constructor(store) {
    this.#store = store;
    this.#dark.addEventListener("change", () => this.#apply(store.facts.theme.choice));
    const stored = localStorage.getItem(STORED);
    this.#apply(stored === "dark" || stored === "light" ? stored : "system");
  }

  /** @param {ThemeChoice} choice */
  choose(choice) {
    localStorage.setItem(STORED, choice);
    this.#apply(choice);
  }

  /** @param {ThemeChoice} choice */
  #apply(choice) {
    const isDark = choice === "system" ? this.#dark.matches : choice === "dark";
    document.documentElement.dataset.theme = isDark ? "dark" : "light"; // tokens.css; before the views draw
    this.#store.set({ theme: { choice, isDark } });
  }
}
