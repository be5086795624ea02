/** Tell the program which layers and image sizes this page shows. A hidden tab shows no view. */

export class ViewRequest {
  #store;
  #send;
  #sent = "";

  /**
   * @param {import("./store.js").Store} store
   * @param {(message: import("./protocol.js").ClientMessage) => void} send
   */
  constructor(store, send) {
    this.#store = store;
    this.#send = send;
    store.subscribe((changed) => {
      // The session is the first message of each connection; a new program does not know this page.
      if (changed.has("session")) this.#sent = "";
      if (changed.has("session") || changed.has("layers") || changed.has("reductions")) this.#ask();
    });
    // The store waits for animation frames, which a hidden tab does not get.
    document.addEventListener("visibilitychange", () => this.#ask());
  }

  #ask() {
    const { session, layers, reductions: ofPanes } = this.#store.facts;
    if (!session || ofPanes.length !== session.cameras.length) return;
    const reductions = document.hidden ? ofPanes.map(() => 0) : ofPanes;
    const shown = /** @type {import("./protocol.js").Layer[]} */ (Object.keys(layers.shown)).filter(
      (id) => layers.shown[id],
    );
    /** @type {import("./protocol.js").ClientMessage} */
    const message = { type: "view", layers: shown, reductions, by_part: layers.colors === "part" };
    const text = JSON.stringify(message);
    if (text === this.#sent) return;
    this.#sent = text;
    this.#send(message);
  }
}
