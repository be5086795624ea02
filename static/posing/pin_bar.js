/** Pins of the selected joint: their number, error and actions. */

import { button, byId, onChange } from "../widgets/elements.js";
import { Menu } from "../widgets/menu.js";
import { displayName } from "../widgets/text.js";

export class PinBar {
  #store;
  #pinning;
  #mode;
  #fit;
  #clear;
  #choices = byId("fit-choices", HTMLButtonElement);
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
    this.#pinning = pinning;
    this.#mode = button("pin-mode", () => pinning.toggle());
    this.#fit = button("pin-fit", () => pinning.fit());
    this.#clear = button("pin-clear", () => pinning.clear());
    new Menu(this.#choices, byId("fit-menu", HTMLElement), () => ({ items: this.#fits() }));
    onChange(this.#live, () => pinning.toggleLive());
    /** @type {(keyof import("../model/store.js").Facts)[]} */
    store.on(["state", "connected", "overlay", "pinning", "livePins", "scope"], () => this.#show());
  }

  #show() {
    const { state, connected, overlay, pinning, livePins, session, scope } = this.#store.facts;
    const joint = state?.point ? displayName(state.point) : null;
    const pins = overlay?.pins ?? [];
    const ofPerson = pins.filter(({ person }) => person === state?.person).length;
    this.#mode.disabled = this.#fit.disabled = this.#choices.disabled = this.#live.disabled = !connected || !state;
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

  /** Whom or what a fit may move. */
  #fits() {
    const { state, session } = this.#store.facts;
    if (!state || !session) return [];
    const { limb } = this.#pinning;
    const name = session.people[state.person].name;
    const isOne = this.#store.facts.scope === "one" || session.people.length < 2;
    const everybody = { text: "All placed people", note: isOne ? "" : "G", title: "Fit everybody who is placed on this frame", run: () => this.#pinning.fit(null) };
    return [
      ...(session.people.length > 1 ? [everybody] : []),
      { text: `Only ${name}`, note: isOne ? "G" : "", title: `Fit ${name} to pins and edges; the others stay`, run: () => this.#pinning.fit(state.person) },
      {
        text: limb ? `Only the ${limb}` : "Only a limb",
        note: limb ? "Alt+G" : "select a joint",
        title: limb ? `Fit the ${limb} to pins and edges; the rest of the body stays` : "Select a joint of the limb first",
        isDisabled: limb === null,
        run: () => this.#pinning.fitLimb(),
      },
    ];
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
