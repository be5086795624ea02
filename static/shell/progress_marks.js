/** Show the progress of background work: compilation after installation, and indexing of new footage. */

import { byId } from "../widgets/elements.js";

/** @param {import("../model/store.js").Store} store */
export function showProgressMarks(store) {
  const compiling = byId("compiling", HTMLElement);
  const listing = byId("listing", HTMLElement);
  store.subscribe((changed) => {
    if (!changed.has("state")) return;
    const group = store.facts.state?.compiling ?? null;
    compiling.hidden = group === null;
    compiling.textContent = `Compiling ${group ?? ""}`;
    showListing(listing, store.facts.state?.footage);
  });
}

/**
 * Frames that are not indexed yet can be requested; they are shown when they are indexed.
 * @param {HTMLElement} mark
 * @param {import("../model/protocol.js").StateMessage["footage"] | undefined} footage
 */
function showListing(mark, footage) {
  const { listed = null, error = null } = footage ?? {};
  mark.hidden = listed === null && error === null;
  mark.classList.toggle("is-failed", error !== null);
  if (error !== null) {
    mark.textContent = "Footage damaged";
    mark.title = error;
  } else if (listed !== null) {
    mark.textContent = `Indexing ${Math.floor(100 * listed)}%`;
    mark.title = "The footage is indexed when it is first opened. Frames can be shown as soon as they are indexed.";
  }
}
