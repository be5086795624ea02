/** Notes on the shown pose, over the images: what deserves a look, each with the button that answers it. */

import { hasSearch } from "../model/selectors.js";
import { byId, make } from "../widgets/elements.js";
import { displayName } from "../widgets/text.js";

/** @typedef {{text: string, button?: {text: string, title: string, run: () => void}}} Note */

export class PoseNotes {
  #store;
  #actions;
  #pinning;
  #grid;
  #list = byId("pose-notes", HTMLUListElement);
  #shown = "";

  /**
   * @param {{store: import("../model/store.js").Store, actions: import("../model/actions.js").Actions,
   *   pinning: import("./pinning.js").Pinning, grid: import("../panes/pane_grid.js").PaneGrid}} parts
   */
  constructor({ store, actions, pinning, grid }) {
    this.#store = store;
    this.#actions = actions;
    this.#pinning = pinning;
    this.#grid = grid;
    store.on(["state", "session", "filled"], () => this.#show());
  }

  #show() {
    const notes = [...this.#ofFit(), ...this.#ofDepth()];
    const described = JSON.stringify(notes);
    if (described === this.#shown) return;
    this.#shown = described;
    this.#list.replaceChildren(...notes.map(row));
  }

  /** Limbs that the last fit moved although nobody had touched them, and where it contradicts the user. */
  #ofFit() {
    const { state, session } = this.#store.facts;
    const last = state?.compared;
    if (!last || hasSearch(state) || state?.replay) return [];
    /** @type {Note[]} */
    const notes = last.moved.map(({ person, limb, distance_cm }, rank) => {
      const whose = (session?.people.length ?? 1) > 1 ? ` of ${session?.people[person].name}` : "";
      const text = `The fit moved the ${limb}${whose} by ${distance_cm.toFixed(0)} cm, which nobody had touched.`;
      const title = `Put only the ${limb}${whose} back (Alt+B)`;
      return rank > 0 ? { text } : { text, button: { text: "Take back", title, run: () => this.#pinning.takeLimbBack() } };
    });
    if (last.warning) {
      const text = last.is_before_shown ? "Show result" : "Compare";
      const title = `${last.is_before_shown ? "Show the result of" : "Show the pose before"} the ${last.work} (Shift+B)`;
      notes.push({ text: last.warning, button: { text, title, run: () => this.#actions.toggleBefore() } });
    }
    return notes;
  }

  /** Why nothing looks across the last placed joint, or null; for the palette. */
  get whyNotAcross() {
    return this.#store.facts.state?.unseen_depth ? null : "The views have shown the depth of the last placed joint.";
  }

  /** Fill the grid with the view that looks across the last placed joint. */
  showAcross() {
    const { state, filled } = this.#store.facts;
    const camera = state?.unseen_depth?.camera;
    if (camera !== undefined && camera !== filled) this.#grid.toggleFill(camera);
  }

  /** The last placed joint, if no view has shown its depth. @returns {Note[]} */
  #ofDepth() {
    const { state, session, filled } = this.#store.facts;
    const unseen = state?.unseen_depth;
    if (!unseen || !session) return [];
    const [point, ...others] = unseen.points;
    const name = session.cameras[unseen.camera].name;
    const more = others.length ? ` and ${others.length} more` : "";
    const text = `No view has shown the depth of the ${displayName(point)}${more}: drag it in ${name}, which looks across.`;
    if (filled === unseen.camera) return [{ text }];
    const title = `Fill the grid with ${name} (Alt+V)`;
    return [{ text, button: { text: `Show ${name}`, title, run: () => this.showAcross() } }];
  }
}

/** @param {Note} note */
function row({ text, button }) {
  const item = make("li", {}, make("span", {}, text));
  if (button) {
    const press = make("button", { type: "button", title: button.title }, button.text);
    press.addEventListener("click", (event) => {
      if (event.detail > 0) press.blur();
      button.run();
    });
    item.append(press);
  }
  return item;
}
