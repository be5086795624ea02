/** Detect whether WebGL renders in software. */

/**
 * Whether WebGL renders without a graphics card. The 3-D view then competes with the panes for processor time.
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
