/** Reasons why commands are unavailable: sentences for the user, null if a command is available. */

import { hasSearch, hasTrack } from "./selectors.js";

/** @typedef {() => string | null} Reason */

/** @typedef {ReturnType<typeof unavailableReasons>} Reasons */

/** @param {import("./store.js").Store} store */
export function unavailableReasons(store) {
  const facts = () => store.facts;
  const away = () =>
    facts().connected && facts().state ? null : "No connection to the program. The page reconnects automatically.";
  /** @type {(why: () => string | null) => Reason} */
  const here = (why) => () => away() ?? why();
  return {
    away,
    undo: here(() => (facts().state?.undo === null ? "Nothing to undo." : null)),
    redo: here(() => (facts().state?.redo === null ? "Nothing to redo." : null)),
    search: here(() => (facts().state?.job.running ? "A search is already running. Stop it first (Esc)." : null)),
    stopSearch: here(() => (hasSearch(facts().state) ? null : "No search is running.")),
    track: here(() => (facts().state?.track.running ? "Tracking is already running. Stop it first (Esc)." : null)),
    tracking: here(() => (hasTrack(facts().state) ? null : "Nothing is being tracked. Press T to start.")),
    range: here(() => (facts().range ? null : "No range is marked. Press [ and ] to mark its ends.")),
    compared: here(() => (facts().state?.compared ? null : "No fit or search result is shown. Press G or F for one.")),
    people: here(() => ((facts().session?.people.length ?? 0) > 1 ? null : "This session has only one person.")),
  };
}
