/** Seconds and edits per verified frame, by annotator. */

import { make, tableRow } from "../widgets/elements.js";
import { fold } from "./parts.js";

/** @param {import("../model/store.js").Store} store */
export function speedTable(store) {
  const head = make("thead", {}, make("tr", {}, ...["name", "verified", "s each", "edits each", "reviewed", "s each"].map((text) => make("th", "", text))));
  const body = make("tbody");
  const element = fold("Speed", "From the history; pauses over 60 s do not count", make("table", "plan-speed", head, body));
  const number = (/** @type {number | null} */ value) => (value === null ? "–" : value.toFixed(1));
  return {
    element,
    show() {
      const speeds = store.facts.annotation?.speeds ?? [];
      element.hidden = speeds.length === 0;
      body.replaceChildren(
        ...speeds.map((one) => {
          const cells = [one.verified, number(one.seconds_per_verified), number(one.edits_per_verified), one.decisions, number(one.seconds_per_decision)];
          return tableRow(one.name || "nobody named", cells.map(String));
        }),
      );
    },
  };
}
