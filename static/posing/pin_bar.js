/** Pins of the selected joint: their number, error and actions. */

import { button, byId } from "../widgets/elements.js";
import { displayName } from "../widgets/text.js";

export class PinBar {
  #store;
  #mode;
  #fit;
  #clear;
  #figures = byId("pin-figures", HTMLOutputElement);
  #live = byId("pin-live", HTMLInputElement);
  #hint = byId("pin-hint", HTMLElement);
  #panes = byId("panes", HTMLElement);

  /**
   * @param {import("../model/store.js").Store} store
   * @param {import("./pinning.js").Pinning} pinning
   */
  constructor(store, pinning) {
    this.#store = store;
    this.#mode = button("pin-mode", () => pinning.toggle());
    this.#fit = button("pin-fit", () => pinning.fit());
    this.#clear = button("pin-clear", () => pinning.clear());
    this.#live.addEventListener("change", () => {
      pinning.toggleLive();
      this.#live.blur();
    });
    /** @type {(keyof import("../model/store.js").Facts)[]} */
    const shown = ["state", "connected", "overlay", "pinning", "livePins", "scope"];
    store.subscribe((changed) => shown.some((fact) => changed.has(fact)) && this.#show());
  }

  #show() {
    const { state, connected, overlay, pinning, livePins, session, scope } = this.#store.facts;
    const joint = state?.point ? displayName(state.point) : null;
    const pins = overlay?.pins ?? [];
    const ofPerson = pins.filter(({ person }) => person === state?.person).length;
    this.#mode.disabled = this.#fit.disabled = this.#live.disabled = !connected || !state;
    this.#clear.disabled = !connected || ofPerson === 0;
    this.#mode.setAttribute("aria-pressed", String(pinning));
    this.#live.checked = livePins;
    const several = (session?.people.length ?? 1) > 1;
    const fitted = several && scope === "all" ? "all placed people" : "the active person";
    this.#fit.title = pins.length
      ? `Fit ${fitted} to pins and edges (G)`
      : `Fit ${fitted} to the edges, and to pins if there are any (G)`;
    const [text, title] = joint === null ? ["", "No joint selected"] : this.#figure(joint, ofPerson);
    this.#figures.textContent = text;
    this.#figures.title = title;
    this.#hint.hidden = !pinning || joint === null;
    if (!this.#hint.hidden) this.#hint.textContent = `Pin ${joint}: click its position in each view. Esc to finish.`;
    this.#panes.classList.toggle("is-pinning", pinning);
  }

  /**
   * @param {string} joint
   * @param {number} ofPerson number of pins of the active person on this frame
   */
  #figure(joint, ofPerson) {
    const { overlay } = this.#store.facts;
    const all = `${counted(ofPerson)} of this person on this frame`;
    const triangulation = overlay?.triangulation;
    if (!triangulation) return ["no pins", `No pins of ${joint}; ${all}`];
    if (triangulation.error_px === null) return [counted(triangulation.pins), `${joint}: ${triangulation.why}; ${all}`];
    const error = `${triangulation.error_px.toFixed(triangulation.error_px < 10 ? 1 : 0)} px`;
    return [`${counted(triangulation.pins)}, ${error}`, `Triangulation error of the pins of ${joint}: ${error}; ${all}`];
  }
}

/** @param {number} pins */
function counted(pins) {
  return pins === 1 ? "1 pin" : `${pins} pins`;
}
