/** Show whether all edits are saved, and retry if saving failed. */

import { button, byId } from "../widgets/elements.js";

export class SavedMark {
  #store;
  #mark;
  #bar = byId("unsaved", HTMLElement);
  #why = byId("unsaved-why", HTMLElement);
  #retry;

  /**
   * @param {import("../model/store.js").Store} store
   * @param {(message: import("../model/protocol.js").ClientMessage) => void} send
   */
  constructor(store, send) {
    this.#store = store;
    const retry = () => send({ type: "save" });
    this.#mark = button("saved", retry);
    this.#retry = button("retry-saving", retry);
    store.on(["state", "connected"], () => this.#show());
    addEventListener("beforeunload", (event) => {
      if (this.isSafe) return;
      event.preventDefault();
      event.returnValue = true; // required by older browsers
    });
  }

  /** Whether closing the page loses nothing: all edits are saved and nothing is being dragged. */
  get isSafe() {
    const { state, dragging } = this.#store.facts;
    return !state || (state.save_error === null && !dragging);
  }

  #show() {
    const { state, connected } = this.#store.facts;
    if (!state) return;
    const { saved, save_error } = state;
    const failed = save_error !== null;
    this.#mark.className = failed ? "is-failed" : saved ? "is-saved" : "is-saving";
    this.#mark.textContent = failed ? "Not saved" : saved ? "All saved" : "Saving";
    this.#mark.title = failed ? `Not saved: ${save_error}. Click to try again.` : saved ? "All edits are saved" : "Saving";
    this.#mark.disabled = this.#retry.disabled = !failed || !connected;
    this.#bar.hidden = !failed;
    this.#why.textContent = failed ? `Not saved: ${save_error}. Edits are kept in memory until saving succeeds.` : "";
  }
}
