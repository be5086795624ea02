/** Says that the footage is being indexed, and how far; frames that are not yet can be asked for, and are waited for. */

import { byId } from "./elements.js";

/** @param {import("./store.js").Store} store */
export function showListing(store) {
  const mark = byId("listing", HTMLElement);
  store.subscribe((changed) => {
    if (!changed.has("state")) return;
    const { listed = null, error = null } = store.facts.state?.footage ?? {};
    mark.hidden = listed === null && error === null;
    mark.classList.toggle("is-failed", error !== null);
    if (error !== null) {
      mark.textContent = "Footage damaged";
      mark.title = error;
    } else if (listed !== null) {
      mark.textContent = `Indexing ${Math.floor(100 * listed)}%`;
      mark.title = "The footage is opened for the first time and its frames are being listed. Frames listed by now are shown, others as soon as they are.";
    }
  });
}
