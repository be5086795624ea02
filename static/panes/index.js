/**
 * Panes: the camera images with everything drawn over them, and the pointer in them.
 *
 * The room imports `widgets`, `model` and `layout`.
 */

import { byId } from "../widgets/elements.js";
import { requestViews } from "../model/view_request.js";
import { makeGestures } from "./gestures.js";
import { mountImageToneMenu } from "./image_tone_menu.js";
import { mountLayersMenu } from "./layers_menu.js";
import { paneBindings } from "./pane_keys.js";
import { PaneGrid } from "./pane_grid.js";
import { showPlaceholders } from "./placeholder_frames.js";
import { mountPoseLegend } from "./pose_legend.js";

/** @typedef {ReturnType<typeof mount>} Panes */

/**
 * Build the grid of panes and its menus.
 *
 * @param {import("../model/index.js").Context} context
 */
export function mount({ store, send, say, latency, layers, imageTones, recentImages }) {
  const gestures = makeGestures(store, send, latency);
  const layersMenu = mountLayersMenu(store, layers);
  const toneMenu = mountImageToneMenu(store, imageTones);
  const grid = new PaneGrid(byId("panes", HTMLElement), store, latency, toneMenu.toggle.bind(toneMenu));
  grid.addPointerTarget(gestures);
  showPlaceholders(store, recentImages);
  requestViews(store, send);
  mountPoseLegend(store);
  return { grid, gestures, bindings: paneBindings({ store, grid, gestures, layersMenu, say }) };
}
