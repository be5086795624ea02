/** The 3-D view in the page's scheme: viser is dark only where its address says so. */

/** @param {HTMLIFrameElement} scene */
export function followColorScheme(scene) {
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const address = () => (dark.matches ? "viser/?darkMode" : "viser/");
  scene.src = address();
  dark.addEventListener("change", () => {
    // Replaced, not visited: the browser's Back leads out of the page as before.
    const target = new URL(address(), document.baseURI).href;
    if (scene.contentWindow) scene.contentWindow.location.replace(target);
    else scene.src = target;
  });
}
