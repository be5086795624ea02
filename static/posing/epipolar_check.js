/**
 * Check the calibration by epipolar lines: the line of sight of the place under the pointer in all other views. A click keeps
 * it, and a second click in another view measures the distance of that place from the line.
 */

import { byId } from "../widgets/elements.js";
import { px } from "../widgets/text.js";

/** @typedef {import("../model/store.js").ViewPoint} ViewPoint */
/** @typedef {import("../panes/pane.js").Pane} Pane */

/** @typedef {ReturnType<typeof makeEpipolarCheck>} EpipolarCheck */

/**
 * @param {import("../model/store.js").Store} store
 * @param {(message: import("../model/protocol.js").ClientMessage) => void} send
 */
export function makeEpipolarCheck(store, send) {
  const hint = byId("epipolar-hint", HTMLElement);
  const panes = byId("panes", HTMLElement);
  let askedFor = "";
  store.on(["connected"], () => (askedFor = ""));
  store.on(["pinning"], () => store.facts.pinning && cancel());
  store.on(["epipolar", "epipolarLines"], () => show());
  store.on(["epipolar", "connected"], () => ask());

  function toggle() {
    const isOn = store.facts.epipolar !== null;
    store.set({ epipolar: isOn ? null : { kept: [], pointer: null }, pinning: false, hover: null, hoverPart: null });
  }

  /** End the check. Returns whether it was going on. */
  function cancel() {
    const wasOn = store.facts.epipolar !== null;
    if (wasOn) store.set({ epipolar: null });
    return wasOn;
  }

  /**
   * Handle the pointer in a pane.
   *
   * @param {Pane} pane
   * @param {number} camera
   */
  function watch(pane, camera) {
    const { surface } = pane;
    surface.addEventListener("pointerdown", (event) => down(event, pane, camera));
    surface.addEventListener("pointermove", (event) => move(event, pane, camera));
    surface.addEventListener("pointerleave", () => point(null));
    surface.addEventListener("dblclick", (event) => store.facts.epipolar && event.stopImmediatePropagation());
  }

  /**
   * @param {PointerEvent} event
   * @param {Pane} pane
   * @param {number} camera
   */
  function down(event, pane, camera) {
    const { epipolar } = store.facts;
    if (!epipolar || event.button !== 0) return;
    event.stopImmediatePropagation();
    const point = place(event, pane, camera);
    const [first, second] = epipolar.kept;
    const kept = first && !second && first.camera !== camera ? [first, point] : [point];
    store.set({ epipolar: { kept, pointer: null } });
  }

  /**
   * @param {PointerEvent} event
   * @param {Pane} pane
   * @param {number} camera
   */
  function move(event, pane, camera) {
    if (!store.facts.epipolar || event.buttons !== 0) return;
    event.stopImmediatePropagation();
    point(place(event, pane, camera));
  }

  /** @param {ViewPoint | null} pointer */
  function point(pointer) {
    const { epipolar } = store.facts;
    if (epipolar) store.set({ epipolar: { ...epipolar, pointer } });
  }

  /** Ask the program for the lines of what is shown. */
  function ask() {
    if (!store.facts.connected) return;
    const points = shownPoints(store.facts).map(({ camera, u, v }) => /** @type {[number, number, number]} */ ([camera, u, v]));
    const asked = JSON.stringify(points);
    if (asked === (askedFor || "[]")) return;
    askedFor = asked;
    send({ type: "epipolar", points });
  }

  function show() {
    const { epipolar } = store.facts;
    panes.classList.toggle("is-checking", epipolar !== null);
    hint.hidden = epipolar === null;
    if (!epipolar) return;
    const text = textOf();
    if (hint.textContent !== text) hint.textContent = text;
  }

  function textOf() {
    const { session, epipolar, epipolarLines } = store.facts;
    const [first] = epipolar?.kept ?? [];
    if (!first) return "Epipolar lines: point at a place in a view; a click keeps its lines. Esc to finish.";
    const name = (/** @type {number} */ camera) => session?.cameras[camera].name ?? "";
    const found = epipolarLines?.distance;
    if (!found) return `Lines of ${name(first.camera)}: point at the same place in another view. Esc to finish.`;
    const mm = found.mm === null ? "" : `, ${found.mm.toFixed(0)} mm at the body`;
    return `${name(found.camera)}: ${px(found.px)} from the line of ${name(first.camera)}${mm}. Esc to finish.`;
  }

  return { toggle, cancel, watch };
}

/**
 * The place whose lines are shown, and the one whose distance is.
 *
 * @param {import("../model/store.js").Facts} facts
 * @returns {ViewPoint[]}
 */
function shownPoints({ epipolar }) {
  if (!epipolar) return [];
  const { kept, pointer } = epipolar;
  if (!pointer || kept.length === 2 || pointer.camera === kept[0]?.camera) return kept;
  return [...kept, pointer];
}

/**
 * @param {PointerEvent} event
 * @param {Pane} pane
 * @param {number} camera
 * @returns {ViewPoint}
 */
function place(event, pane, camera) {
  const at = pane.locate(event);
  return { camera, ...pane.view.toImage(at.x, at.y) };
}
