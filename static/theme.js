/**
 * Set the colour scheme before anything is drawn, as `model/theme.js` does whenever it changes.
 *
 * A plain script, because modules run only after the page has been drawn once.
 */
{
  const stored = localStorage.getItem("quadrille.theme");
  const isDark = matchMedia("(prefers-color-scheme: dark)").matches;
  document.documentElement.dataset.theme = stored === "dark" || stored === "light" ? stored : isDark ? "dark" : "light";
}
