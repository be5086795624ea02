/**
 * Load the 3-D view, and keep its look that of the page: only the canvas of viser shows, on the page's background.
 *
 * viser has panels of its own, and takes its colour scheme from its address. Another address would load the scene again.
 */

/** viser's page is an application within this one: its panels, messages and mobile sheet would repeat the page's. */
const STYLE = `
  body * { visibility: hidden !important; }
  body canvas { visibility: visible !important; }
  html, body { background: var(--page-stage) !important; }
`;

/**
 * @param {HTMLIFrameElement} scene
 * @param {import("../model/store.js").Store} store
 */
export function loadScene(scene, store) {
  const paint = () => {
    const stage = getComputedStyle(document.documentElement).getPropertyValue("--stage");
    // A frame that loads or leaves has a document without an element.
    scene.contentDocument?.documentElement?.style.setProperty("--page-stage", stage);
  };
  scene.addEventListener("load", () => {
    const target = scene.contentDocument;
    if (!target) return;
    const style = target.createElement("style");
    style.textContent = STYLE;
    target.head.append(style);
    paint();
  });
  store.on(["theme"], () => paint());
  scene.src = store.facts.theme.isDark ? "viser/?darkMode" : "viser/";
}
