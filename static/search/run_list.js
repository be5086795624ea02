/** Search runs of the current frame: results, differing settings, and buttons to compare and apply. */

import { lineSwatch } from "../widgets/series_lines.js";
import { byId, make, textButton } from "../widgets/elements.js";
import { selectedRun } from "../model/search_runs.js";
import { count, px } from "../widgets/text.js";

/** @typedef {{element: HTMLElement, figures: HTMLElement, differs: HTMLElement, compare: HTMLButtonElement, take: HTMLButtonElement}} Row */

export class RunList {
  #store;
  #send;
  #list = make("div", "run-rows");
  /** @type {Map<number, Row>} */
  #rows = new Map();

  /**
   * @param {import("../model/store.js").Store} store
   * @param {(message: import("../model/protocol.js").ClientMessage) => void} send
   */
  constructor(store, send) {
    this.#store = store;
    this.#send = send;
    const head = make("h3", { title: "Searches of this frame. Earlier runs are kept for comparison" }, "Runs");
    byId("search-runs", HTMLElement).append(head, this.#list);
  }

  /** @param {Set<keyof import("../model/store.js").Facts>} changed */
  update(changed) {
    if (!["drawer", "searchRuns", "searchRun"].some((fact) => changed.has(/** @type {"drawer"} */ (fact)))) return;
    const { searchRuns } = this.#store.facts;
    const runs = [...(searchRuns?.runs ?? [])].reverse();
    const numbers = runs.map(({ number }) => number);
    if (numbers.join() !== [...this.#rows.keys()].join()) {
      const previous = this.#rows;
      this.#rows = new Map(numbers.map((number) => [number, previous.get(number) ?? this.#makeRow(number)]));
      this.#list.replaceChildren(...[...this.#rows.values()].map(({ element }) => element));
      if (numbers.length === 0) this.#list.textContent = "No runs";
    }
    for (const run of runs) this.#show(run);
  }

  /**
   * @param {number} number
   * @returns {Row}
   */
  #makeRow(number) {
    const look = textButton(`Run ${number}`, `Show costs, stages and candidates of run ${number}`, () => {
      this.#store.set({ searchRun: number });
    }, { className: "run-name" }); // prettier-ignore
    look.prepend(lineSwatch(number - 1));
    const figures = make("div", "run-figures");
    const differs = make("div", "run-differs is-clipped");
    const compare = textButton("Compare", `Show the pose found by run ${number} in the views, dashed`, () => {
      const isOn = this.#store.facts.searchRuns?.compared === number;
      this.#send({ type: "compare", run: isOn ? null : number });
    });
    const take = textButton("Apply", `Use the pose found by run ${number}. Can be undone`, () =>
      this.#send({ type: "take", run: number, candidate: null }),
    );
    return { element: make("div", "run-row", look, figures, compare, take, differs), figures, differs, compare, take };
  }

  /** @param {import("../model/protocol.js").SearchRun} run */
  #show(run) {
    const row = this.#rows.get(run.number);
    if (!row) return;
    const { searchRuns } = this.#store.facts;
    row.element.classList.toggle("is-selected", selectedRun(this.#store.facts)?.number === run.number);
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
