/** Why a command is not possible now: sentences for the user, null where it is possible. */

import { hasSearch, hasTrack } from "./selectors.js";

/** @typedef {() => string | null} Reason */

/** @typedef {ReturnType<typeof unavailableReasons>} Reasons */

/** @param {import("./store.js").Store} store */
export function unavailableReasons(store) {
  const facts = () => store.facts;
  const away = () =>
    facts().connected && facts().state ? null : "The program does not answer; the page connects again by itself.";
  /** @type {(why: () => string | null) => Reason} */
  const here = (why) => () => away() ?? why();
  return {
    away,
    undo: here(() => (facts().state?.undo === null ? "There is nothing to undo." : null)),
    redo: here(() => (facts().state?.redo === null ? "There is nothing to redo: nothing has been undone since the last edit." : null)),
    search: here(() => (facts().state?.job.running ? "A search is at work; stop it first (Esc)." : null)),
    stopSearch: here(() => (hasSearch(facts().state) ? null : "No search is at work.")),
    track: here(() => (facts().state?.track.running ? "A tracking run is at work; stop it first (Esc)." : null)),
    tracking: here(() => (hasTrack(facts().state) ? null : "No tracking run stands; T begins one.")),
    range: here(() => (facts().range ? null : "No range is marked: [ begins one, ] ends it.")),
    people: here(() => ((facts().session?.people.length ?? 0) > 1 ? null : "There is only one person in this session.")),
  };
}
