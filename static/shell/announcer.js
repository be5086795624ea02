/** Announce changes in a live region for screen readers. */

import { displayName } from "../widgets/text.js";

const SETTLED_MS = 400;

export class Announcer {
  #store;
  #region;
  /** @type {import("../model/protocol.js").StateMessage | null} what was last announced */
  #announced = null;
  #timer = 0;

  /**
   * @param {HTMLElement} region
   * @param {import("../model/store.js").Store} store
   */
  constructor(region, store) {
    this.#region = region;
    this.#store = store;
    store.on(["state"], () => {
      this.#announced ??= store.facts.state;
      clearTimeout(this.#timer);
      // Wait until a sequence of changes has ended.
      this.#timer = setTimeout(() => this.#announce(), SETTLED_MS);
    });
  }

  #announce() {
    const { state, session, playing, dragging } = this.#store.facts;
    if (!state || playing || dragging || state.track.running) return;
    const before = this.#announced ?? state;
    this.#announced = state;
    const words = [];
    if (state.person !== before.person) words.push(session?.people[state.person]?.name ?? "");
    if (state.point !== before.point && state.point) words.push(`${displayName(state.point)} selected`);
    if (state.undo !== before.undo || state.redo !== before.redo) {
      words.push(state.redo !== null && state.redo !== before.redo ? `undone: ${state.redo}` : (state.undo ?? "nothing to undo"));
    }
    if (state.frame !== before.frame) {
      words.push(`frame ${state.frame}, ${[state.source ?? "no pose", state.status].filter(Boolean).join(", ")}`);
    }
    if (state.job.message && state.job.message !== before.job.message) words.push(state.job.message);
    if (state.track.message && state.track.message !== before.track.message) words.push(state.track.message);
    if (words.length) this.#region.textContent = `${words.join("; ")}.`;
  }
}
