/** The keys of several people; `keys.js` takes them into its table. */

import { plain } from "../widgets/key_matching.js";
import { unavailableReasons } from "../model/unavailable_reasons.js";

/**
 * @param {{store: import("../model/store.js").Store, actions: import("../model/actions.js").Actions,
 *   posing: import("../posing/posing.js").Posing, people: import("./people.js").People}} parts
 * @returns {import("../widgets/key_matching.js").Binding[]}
 */
export function peopleBindings({ store, actions, posing, people }) {
  const why = unavailableReasons(store).people;
  const shift = (/** @type {string} */ key) => plain(key, undefined, true);
  return [
    { keys: ["P"], label: "Work on the next person", matches: plain("p"), why, run: () => actions.stepPerson(1) },
    { keys: ["Shift P"], label: "Work on the person before", matches: shift("p"), why, run: () => actions.stepPerson(-1) },
    { keys: ["Shift A"], label: "Solo: dim the others, or no more", matches: shift("a"), why, run: () => actions.toggleSolo() },
    {
      keys: ["Shift V"],
      label: "Show or hide the person worked on",
      matches: shift("v"),
      why,
      run: () => actions.toggleShown(),
    },
    {
      keys: ["Shift E"],
      label: "Search and fit everybody, or only the person worked on",
      matches: shift("e"),
      why,
      run: () => actions.toggleScope(),
    },
    {
      keys: ["Shift C"],
      label: "Copy the pose of the next person; place and turn stay",
      matches: shift("c"),
      why,
      run: () => posing.copyNextPerson(),
    },
    { keys: ["Shift U"], label: "List of the people", matches: shift("u"), why, run: () => people.toggle() },
  ];
}
