/**
 * Scene: the 3-D view, which viser draws in an iframe, and the floor.
 *
 * The room imports `widgets`, and types of `model` and `panes`.
 */

import { byId } from "../widgets/elements.js";
import { drawsInSoftware } from "../widgets/webgl.js";
import { loadScene } from "./appearance.js";
import { mountCameraView } from "./camera_view.js";
import { makeFloor } from "./floor.js";
import { pauseScene } from "./pause.js";
import { sceneBindings } from "./scene_keys.js";

/** @typedef {ReturnType<typeof mount>} SceneRoom */

/** Groups of kernels that are compiled before the first cost, or beside what it needs. */
const BEFORE_COST = new Set(["posing", "contours", "evidence", "cost"]);

/**
 * Prepare the 3-D view, which is loaded once the panes show their first images.
 *
 * @param {import("../model/index.js").Context} context
 * @param {import("../panes/index.js").Panes} panes
 */
export function mount({ store, send, reasons }, { grid }) {
  const frame = byId("scene", HTMLIFrameElement);
  const floor = makeFloor(byId("panes", HTMLElement), store, grid, send);
  const cameraView = mountCameraView(store, grid, send);
  const isSoftware = drawsInSoftware();
  if (isSoftware) pauseScene(frame, store);
  loadLate(frame, store, isSoftware);
  return { frame, floor, isSoftware, bindings: sceneBindings(cameraView, floor, reasons.away) };
}

/** A gizmo of the 3-D view moves people: shared links have none. */
function showNoScene() {
  byId("scene-note", HTMLElement).hidden = false;
}

/**
 * Load the 3-D view after the first images: viser is a large program. Without a graphics card its start stops the page
 * for seconds, so that it comes after the first cost where kernels are being compiled.
 *
 * @param {HTMLIFrameElement} frame
 * @param {import("../model/store.js").Store} store
 * @param {boolean} isSoftware
 */
function loadLate(frame, store, isSoftware) {
  let isLoaded = false;
  store.subscribe(() => {
    const { shown, state, session } = store.facts;
    if (isLoaded || shown === null || state === null) return;
    if (session && session.role !== "host") return showNoScene();
    if (isSoftware && BEFORE_COST.has(state.compiling ?? "") && state.cost_px === null) return;
    isLoaded = true;
    loadScene(frame, store);
  });
}
