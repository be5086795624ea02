/** Pins of the selected joint: their number, error and actions. */

import { button, byId, onChange } from "../widgets/elements.js";
import { mountMenu } from "../widgets/menu.js";
import { displayName } from "../widgets/text.js";

/**
 * @param {import("../model/store.js").Store} store
 * @param {import("./pinning.js").Pinning} pinning
 */
export function mountPinBar(store, pinning) {
  const choices = byId("fit-choices", HTMLButtonElement);
  const figures = byId("pin-figures", HTMLOutputElement);
  const live = byId("pin-live", HTMLInputElement);
  const hint = byId("pin-hint", HTMLElement);
  const panes = byId("panes", HTMLElement);
  const mode = button("pin-mode", () => pinning.toggle());
  const fit = button("pin-fit", () => pinning.fit());
  const clear = button("pin-clear", () => pinning.clear());
  mountMenu(choices, byId("fit-menu", HTMLElement), () => ({ items: fits() }));
  onChange(live, () => pinning.toggleLive());
  store.on(["state", "connected", "overlay", "pinning", "livePins", "scope"], show);

  function show() {
    const { state, connected, overlay, pinning, livePins, session, scope } = store.facts;
    const joint = state?.point ? displayName(state.point) : null;
    const pins = overlay?.pins ?? [];
    const ofPerson = pins.filter(({ person }) => person === state?.person).length;
    mode.disabled = fit.disabled = choices.disabled = live.disabled = !connected || !state;
    clear.disabled = !connected || ofPerson === 0;
    mode.setAttribute("aria-pressed", String(pinning));
    live.checked = livePins;
    const several = (session?.people.length ?? 1) > 1;
    const fitted = several && scope === "all" ? "all placed people" : "the active person";
    fit.title = pins.length
      ? `Fit ${fitted} to pins and edges (G)`
      : `Fit ${fitted} to the edges, and to pins if there are any (G)`;
    const [text, title] = joint === null ? ["", "No joint selected"] : figure(joint, ofPerson);
    figures.textContent = text;
    figures.title = title;
    hint.hidden = !pinning || joint === null;
    if (!hint.hidden) hint.textContent = `Pin ${joint}: click its position in each view. Esc to finish.`;
    panes.classList.toggle("is-pinning", pinning);
  }

  /** Whom or what a fit may move. */
  function fits() {
    const { state, session } = store.facts;
    if (!state || !session) return [];
    const limb = pinning.limb();
    const name = session.people[state.person].name;
    const everybody = { text: "All placed people", note: "", title: "Fit everybody who is placed on this frame", run: () => pinning.fit(null) };
    return [
      ...(session.people.length > 1 ? [everybody] : []),
      { text: `Only ${name}`, note: "", title: `Fit ${name} to pins and edges; the others stay`, run: () => pinning.fit(state.person) },
      {
        text: limb ? `Only the ${limb}` : "Only a limb",
        note: limb ? "" : "select a joint",
        title: limb ? `Fit the ${limb} to pins and edges; the rest of the body stays` : "Select a joint of the limb first",
        isDisabled: limb === null,
        run: () => pinning.fitLimb(),
      },
    ];
  }

  /**
   * @param {string} joint
   * @param {number} ofPerson number of pins of the active person on this frame
   */
  function figure(joint, ofPerson) {
    const { overlay } = store.facts;
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
