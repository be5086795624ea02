/** Load the 3-D view in the page's colour scheme, which is part of viser's address. */

/** @param {HTMLIFrameElement} scene */
export function followColorScheme(scene) {
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const address = () => (dark.matches ? "viser/?darkMode" : "viser/");
  scene.src = address();
  dark.addEventListener("change", () => {
    // Replace the address, so that no entry is added to the browser's history.
    const target = new URL(address(), document.baseURI).href;
    if (scene.contentWindow) scene.contentWindow.location.replace(target);
    else scene.src = target;
  });
}
