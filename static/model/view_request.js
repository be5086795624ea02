/**
 * Tell the program which layers and image sizes this page shows. A hidden tab shows no view.
 *
 * @param {import("./store.js").Store} store
 * @param {(message: import("./protocol.js").ClientMessage) => void} send
 */
export function requestViews(store, send) {
  let sent = "";
  store.subscribe((changed) => {
    // The session is the first message of each connection; a new program does not know this page.
    if (changed.has("session")) sent = "";
    if (changed.has("session") || changed.has("layers") || changed.has("reductions")) ask();
  });
  // The store waits for animation frames, which a hidden tab does not get.
  document.addEventListener("visibilitychange", () => ask());

  function ask() {
    const { session, layers, reductions: ofPanes } = store.facts;
    if (!session || ofPanes.length !== session.cameras.length) return;
    const reductions = document.hidden ? ofPanes.map(() => 0) : ofPanes;
    const shown = /** @type {import("./protocol.js").Layer[]} */ (Object.keys(layers.shown)).filter(
      (id) => layers.shown[id],
    );
    /** @type {import("./protocol.js").ClientMessage} */
    const message = { type: "view", layers: shown, reductions, by_part: layers.colors === "part" };
    const text = JSON.stringify(message);
    if (text === sent) return;
    sent = text;
    send(message);
  }
}
