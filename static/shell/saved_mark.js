/** Show whether all edits are saved, and retry if saving failed. */

import { button, byId } from "../widgets/elements.js";

/**
 * @param {import("../model/store.js").Store} store
 * @param {(message: import("../model/protocol.js").ClientMessage) => void} send
 */
export function mountSavedMark(store, send) {
  const bar = byId("unsaved", HTMLElement);
  const why = byId("unsaved-why", HTMLElement);
  const retry = () => send({ type: "save" });
  const mark = button("saved", retry);
  const retryButton = button("retry-saving", retry);
  store.on(["state", "connected"], show);
  addEventListener("beforeunload", (event) => {
    if (isSafe()) return;
    event.preventDefault();
    event.returnValue = true; // required by older browsers
  });

  /** Whether closing the page loses nothing: all edits are saved and nothing is being dragged. */
  function isSafe() {
    const { state, dragging } = store.facts;
    return !state || (state.save_error === null && !dragging);
  }

  function show() {
    const { state, connected } = store.facts;
    if (!state) return;
    const { saved, save_error } = state;
    const failed = save_error !== null;
    mark.className = failed ? "is-failed" : saved ? "is-saved" : "is-saving";
    mark.textContent = failed ? "Not saved" : saved ? "All saved" : "Saving";
    mark.title = failed ? `Not saved: ${save_error}. Click to try again.` : saved ? "All edits are saved" : "Saving";
    mark.disabled = retryButton.disabled = !failed || !connected;
    bar.hidden = !failed;
    why.textContent = failed ? `Not saved: ${save_error}. Edits are kept in memory until saving succeeds.` : "";
  }
}
