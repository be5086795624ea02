/** Table of what the tracker searched on the frame, from the store. */

import { make } from "../widgets/elements.js";
import { capital } from "../widgets/text.js";

/** @typedef {import("../model/protocol.js").TriedSearch} TriedSearch */

const COSTS = "Costs in nats, comparable within a line: 3 nats less are 20 times as likely";

/** @returns {{element: HTMLElement, show: (tried: readonly TriedSearch[] | null | undefined) => void}} */
export function triedTable() {
  const sentence = make("p", "section-note");
  const table = make("table", "tried-table");
  const element = make("div", "tried", make("h4", {}, "Searched by the tracker on this frame"), sentence, table);
  let shown = "";
  return {
    element,
    /** @param tried null where it is not known; undefined without a pose */
    show(tried) {
      element.hidden = tried === undefined;
      const key = JSON.stringify(tried ?? null);
      if (key === shown) return;
      shown = key;
      sentence.textContent = !tried
        ? "Not known: no tracker has made this pose, or one of an earlier version."
        : "Nothing: the pose that was refined from its prediction was credible.";
      sentence.hidden = !!tried?.length;
      table.hidden = !tried?.length;
      table.replaceChildren(...(tried?.length ? [line("th", ["", "Cost, nats", "Result"]), ...tried.map(row)] : []));
    },
  };
}

/** @param {TriedSearch} search */
function row({ what, before_nats, after_nats, taken }) {
  const costs = after_nats === null ? nats(before_nats) : `${nats(before_nats)} → ${nats(after_nats)}`;
  const result = taken ? "taken" : after_nats === null ? "none as good" : "not taken";
  const element = line("td", [capital(what), costs, result]);
  element.classList.toggle("is-taken", taken);
  return element;
}

/**
 * @param {"th" | "td"} kind
 * @param {string[]} texts
 */
function line(kind, texts) {
  return make("tr", { title: COSTS }, ...texts.map((textContent) => make(kind, {}, textContent)));
}

/** @param {number} cost */
function nats(cost) {
  return cost.toFixed(Math.abs(cost) < 10 ? 1 : 0).replace("-", "−");
}
