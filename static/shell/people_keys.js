/** Keys for sessions with several people. */

import { inArea, plain } from "../widgets/key_matching.js";

/**
 * @param {{actions: import("../model/actions.js").Actions, posing: import("../posing/posing.js").Posing,
 *   people: import("./people.js").People, reasons: import("../model/unavailable_reasons.js").Reasons}} parts
 */
export function peopleBindings({ actions, posing, people, reasons }) {
  const why = reasons.people;
  const shift = (/** @type {string} */ key) => plain(key, undefined, true);
  return inArea("People", [
    { keys: ["P"], label: "Select the next person", matches: plain("p"), why, run: () => actions.stepPerson(1) },
    { keys: ["Shift P"], label: "Select the previous person", matches: shift("p"), why, run: () => actions.stepPerson(-1) },
    { keys: ["Shift A"], label: "Solo: dim other people (toggle)", matches: shift("a"), why, run: () => actions.toggleSolo() },
    {
      keys: ["Shift V"],
      label: "Show or hide the active person",
      matches: shift("v"),
      why,
      run: () => actions.toggleShown(),
    },
    {
      keys: ["Shift E"],
      label: "Search and fit everyone or only the active person (toggle)",
      matches: shift("e"),
      why,
      run: () => actions.toggleScope(),
    },
    {
      keys: ["Shift C"],
      label: "Copy the next person's angles",
      matches: shift("c"),
      why,
      run: () => posing.copyNextPerson(),
    },
    { keys: ["Shift U"], label: "List of people", matches: shift("u"), why, run: () => people.toggle() },
  ]);
}
