/** Search runs of the current frame: results, differing settings, and buttons to compare and apply. */

import { lineSwatch } from "../widgets/series_lines.js";
import { byId, make, textButton } from "../widgets/elements.js";
import { selectedRun } from "../model/search_runs.js";
import { count, px } from "../widgets/text.js";

/**
 * @typedef {{element: HTMLElement, figures: HTMLElement, differs: HTMLElement, compare: HTMLButtonElement, take: HTMLButtonElement}} Row
 * @param {import("../model/store.js").Store} store
 * @param {(message: import("../model/protocol.js").ClientMessage) => void} send
 */
export function mountRunList(store, send) {
  const list = make("div", "run-rows");
  /** @type {Map<number, Row>} */
  let rows = new Map();
  const head = make("h3", { title: "Searches of this frame. Earlier runs are kept for comparison" }, "Runs");
  byId("search-runs", HTMLElement).append(head, list);

  store.onTab("search", ["searchRuns", "searchRun"], () => {
    const { searchRuns } = store.facts;
    const runs = [...(searchRuns?.runs ?? [])].reverse();
    const numbers = runs.map(({ number }) => number);
    if (numbers.join() !== [...rows.keys()].join()) {
      const previous = rows;
      rows = new Map(numbers.map((number) => [number, previous.get(number) ?? makeRow(number)]));
      list.replaceChildren(...[...rows.values()].map(({ element }) => element));
      if (numbers.length === 0) list.textContent = "No runs";
    }
    for (const run of runs) show(run);
  });

  /**
   * @param {number} number
   * @returns {Row}
   */
  function makeRow(number) {
    const look = textButton(`Run ${number}`, `Show costs, stages and candidates of run ${number}`, () => {
      store.set({ searchRun: number });
    }, { className: "run-name" }); // prettier-ignore
    look.prepend(lineSwatch(number - 1));
    const figures = make("div", "run-figures");
    const differs = make("div", "run-differs is-clipped");
    const compare = textButton("Compare", `Show the pose found by run ${number} in the views, dashed`, () => {
      const isOn = store.facts.searchRuns?.compared === number;
      send({ type: "compare", run: isOn ? null : number });
    });
    const take = textButton("Apply", `Use the pose found by run ${number}. Can be undone`, () =>
      send({ type: "take", run: number, candidate: null }),
    );
    return { element: make("div", "run-row", look, figures, compare, take, differs), figures, differs, compare, take };
  }

  /** @param {import("../model/protocol.js").SearchRun} run */
  function show(run) {
    const row = rows.get(run.number);
    if (!row) return;
    const { searchRuns } = store.facts;
    row.element.classList.toggle("is-selected", selectedRun(store.facts)?.number === run.number);
    const state = run.state === "over" ? "" : run.state === "running" ? "running · " : "paused · ";
    const thinned = run.thinned ? `. ${count(run.steps)} of its steps are kept` : "";
    set(row.figures, `${state}${px(run.best_px)} · ${count(run.evaluations)} · ${run.seconds.toFixed(2)} s`);
    row.figures.title = `Lowest cost (at the start ${px(run.start_px)}), poses evaluated, computing time${thinned}`;
    const differs = Object.entries(run.differs).map(([label, value]) => `${label} ${value}`);
    set(row.differs, differs.join(" · "));
    row.differs.title = differs.length ? `Settings that differ between runs:\n${differs.join("\n")}` : "";
    row.compare.setAttribute("aria-pressed", String(searchRuns?.compared === run.number));
    row.compare.disabled = row.take.disabled = run.steps === 0 || run.state === "running";
  }
}

/**
 * @param {HTMLElement} element
 * @param {string} text
 */
function set(element, text) {
  if (element.textContent !== text) element.textContent = text;
}
