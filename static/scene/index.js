/**
 * Scene: the 3-D view, which viser draws in an iframe, and the floor.
 *
 * The room imports `widgets`, and types of `model` and `panes`.
 */

import { byId } from "../widgets/elements.js";
import { drawsInSoftware } from "../widgets/webgl.js";
import { loadScene } from "./appearance.js";
import { CameraView } from "./camera_view.js";
import { Floor } from "./floor.js";
import { ScenePause } from "./pause.js";
import { sceneBindings } from "./scene_keys.js";

/** @typedef {ReturnType<typeof mount>} SceneRoom */

/**
 * Prepare the 3-D view, which is loaded once the panes show their first images.
 *
 * @param {import("../model/index.js").Context} context
 * @param {import("../panes/index.js").Panes} panes
 */
export function mount({ store, send, reasons }, { grid }) {
  const frame = byId("scene", HTMLIFrameElement);
  const floor = new Floor(byId("panes", HTMLElement), store, grid, send);
  const cameraView = new CameraView(store, grid, send);
  const isSoftware = drawsInSoftware();
  if (isSoftware) new ScenePause(frame, store);
  // viser is a large program: loaded earlier, it would delay the first images.
  store.onceKnown("shown", () => loadScene(frame, store));
  return { frame, floor, isSoftware, bindings: sceneBindings(cameraView, floor, reasons.away) };
}
