/** What a user can want, whichever button or key says it. */

export class Actions {
  #store;
  #send;

  /**
   * @param {import("./store.js").Store} store
   * @param {(message: import("./protocol.js").ClientMessage) => void} send
   */
  constructor(store, send) {
    this.#store = store;
    this.#send = send;
  }

  undo() {
    this.#send({ type: "undo" });
  }

  redo() {
    this.#send({ type: "redo" });
  }

  /** @param {"step" | "frame" | "stop"} action */
  search(action) {
    this.#send({ type: "search", action });
  }

  /** @param {number} person */
  selectPerson(person) {
    this.#send({ type: "select", person, point: null });
  }

  /** @param {import("./protocol.js").Base} base */
  showBase(base) {
    this.#view({ base });
  }

  /**
   * @param {keyof import("./protocol.js").Overlays} layer
   * @param {boolean} isShown
   */
  showOverlay(layer, isShown) {
    const { state } = this.#store.facts;
    if (state) this.#view({ overlays: { ...state.overlays, [layer]: isShown } });
  }

  /**
   * Show it at once: the program's answer says the same.
   *
   * @param {Partial<Pick<import("./protocol.js").StateMessage, "base" | "overlays">>} change
   */
  #view(change) {
    const { state } = this.#store.facts;
    if (!state) return;
    const changed = { ...state, ...change };
    this.#store.set({ state: changed });
    this.#send({ type: "view", base: changed.base, overlays: changed.overlays });
  }
}

/**
 * Whether there is a search to stop: one that runs, or one that waits between two steps.
 *
 * @param {import("./protocol.js").StateMessage | null} state
 */
export function hasSearch(state) {
  return !!state && (state.job.running || state.job.kind !== null);
}
