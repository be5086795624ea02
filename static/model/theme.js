/** Colour scheme of the page: dark, light, or that of the system. Stored in the browser. */

const STORED = "quadrille.theme";

/**
 * @typedef {"system" | "dark" | "light"} ThemeChoice
 * @param {import("./store.js").Store} store
 */
export function makeThemes(store) {
  const dark = matchMedia("(prefers-color-scheme: dark)");
  dark.addEventListener("change", () => apply(store.facts.theme.choice));
  const stored = localStorage.getItem(STORED);
  apply(stored === "dark" || stored === "light" ? stored : "system");

  /** @param {ThemeChoice} choice */
  function choose(choice) {
    localStorage.setItem(STORED, choice);
    apply(choice);
  }

  /** @param {ThemeChoice} choice */
  function apply(choice) {
    const isDark = choice === "system" ? dark.matches : choice === "dark";
    document.documentElement.dataset.theme = isDark ? "dark" : "light"; // tokens.css; before the views draw
    store.set({ theme: { choice, isDark } });
  }

  return { choose };
}
