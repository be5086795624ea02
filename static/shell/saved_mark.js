/** Show whether all edits are saved, and retry if saving failed. */

import { button } from "../widgets/elements.js";

/**
 * @param {import("../model/store.js").Store} store
 * @param {(message: import("../model/protocol.js").ClientMessage) => void} send
 */
export function mountSavedMark(store, send) {
  const mark = button("saved", () => send({ type: "save" }));
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
    mark.disabled = !failed || !connected;
  }
}
