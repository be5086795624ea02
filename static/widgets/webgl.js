/** How the browser draws 3-D. */

/**
 * Whether WebGL is drawn without a graphics card, so that the 3-D view takes the time that the panes need.
 *
 * @returns {boolean}
 */
export function drawsInSoftware() {
  const context = document.createElement("canvas").getContext("webgl");
  if (!context) return true;
  const names = context.getExtension("WEBGL_debug_renderer_info");
  const renderer = context.getParameter(names ? names.UNMASKED_RENDERER_WEBGL : context.RENDERER);
  context.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|software|basic render/i.test(String(renderer));
}
