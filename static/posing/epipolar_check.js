/**
 * Check the calibration by epipolar lines: the line of sight of the place under the pointer in all other views. A click keeps
 * it, and a second click in another view measures the distance of that place from the line.
 */

import { byId } from "../widgets/elements.js";
import { px } from "../widgets/text.js";

/** @typedef {import("../model/store.js").ViewPoint} ViewPoint */
/** @typedef {import("../panes/pane.js").Pane} Pane */

export class EpipolarCheck {
  #store;
  #send;
  #hint = byId("epipolar-hint", HTMLElement);
  #panes = byId("panes", HTMLElement);
  #asked = "";

  /**
   * @param {import("../model/store.js").Store} store
   * @param {(message: import("../model/protocol.js").ClientMessage) => void} send
   */
  constructor(store, send) {
    this.#store = store;
    this.#send = send;
    store.on(["connected"], () => (this.#asked = ""));
    store.on(["pinning"], () => store.facts.pinning && this.cancel());
    store.on(["epipolar", "epipolarLines"], () => this.#show());
    store.on(["epipolar", "connected"], () => this.#ask());
  }

  toggle() {
    const isOn = this.#store.facts.epipolar !== null;
    this.#store.set({ epipolar: isOn ? null : { kept: [], pointer: null }, pinning: false, hover: null, hoverPart: null });
  }

  /** End the check. Returns whether it was going on. */
  cancel() {
    const wasOn = this.#store.facts.epipolar !== null;
    if (wasOn) this.#store.set({ epipolar: null });
    return wasOn;
  }

  /**
   * Handle the pointer in a pane.
   *
   * @param {Pane} pane
   * @param {number} camera
   */
  watch(pane, camera) {
    const { surface } = pane;
    surface.addEventListener("pointerdown", (event) => this.#down(event, pane, camera));
    surface.addEventListener("pointermove", (event) => this.#move(event, pane, camera));
    surface.addEventListener("pointerleave", () => this.#point(null));
    surface.addEventListener("dblclick", (event) => this.#store.facts.epipolar && event.stopImmediatePropagation());
  }

  /**
   * @param {PointerEvent} event
   * @param {Pane} pane
   * @param {number} camera
   */
  #down(event, pane, camera) {
    const { epipolar } = this.#store.facts;
    if (!epipolar || event.button !== 0) return;
    event.stopImmediatePropagation();
    const point = place(event, pane, camera);
    const [first, second] = epipolar.kept;
    const kept = first && !second && first.camera !== camera ? [first, point] : [point];
    this.#store.set({ epipolar: { kept, pointer: null } });
  }

  /**
   * @param {PointerEvent} event
   * @param {Pane} pane
   * @param {number} camera
   */
  #move(event, pane, camera) {
    if (!this.#store.facts.epipolar || event.buttons !== 0) return;
    event.stopImmediatePropagation();
    this.#point(place(event, pane, camera));
  }

  /** @param {ViewPoint | null} pointer */
  #point(pointer) {
    const { epipolar } = this.#store.facts;
    if (epipolar) this.#store.set({ epipolar: { ...epipolar, pointer } });
  }

  /** Ask the program for the lines of what is shown. */
  #ask() {
    if (!this.#store.facts.connected) return;
    const points = shownPoints(this.#store.facts).map(({ camera, u, v }) => /** @type {[number, number, number]} */ ([camera, u, v]));
    const asked = JSON.stringify(points);
    if (asked === (this.#asked || "[]")) return;
    this.#asked = asked;
    this.#send({ type: "epipolar", points });
  }

  #show() {
    const { epipolar } = this.#store.facts;
    this.#panes.classList.toggle("is-checking", epipolar !== null);
    this.#hint.hidden = epipolar === null;
    if (!epipolar) return;
    const text = this.#text();
    if (this.#hint.textContent !== text) this.#hint.textContent = text;
  }

  #text() {
    const { session, epipolar, epipolarLines } = this.#store.facts;
    const [first] = epipolar?.kept ?? [];
    if (!first) return "Epipolar lines: point at a place in a view; a click keeps its lines. Esc to finish.";
    const name = (/** @type {number} */ camera) => session?.cameras[camera].name ?? "";
    const found = epipolarLines?.distance;
    if (!found) return `Lines of ${name(first.camera)}: point at the same place in another view. Esc to finish.`;
    const mm = found.mm === null ? "" : `, ${found.mm.toFixed(0)} mm at the body`;
    return `${name(found.camera)}: ${px(found.px)} from the line of ${name(first.camera)}${mm}. Esc to finish.`;
  }
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
