/** Top bar: session, search or tracking progress, cost, undo and redo. */

import { usualCosts } from "../model/cells.js";
import { hasSearch, hasTrack, personCells, stopTitle } from "../model/selectors.js";
import { button, byId, make } from "../widgets/elements.js";
import { count, displayName, px } from "../widgets/text.js";

export class TopBar {
  #store;
  #session = byId("session-name", HTMLElement);
  #cost = byId("cost", HTMLElement);
  #usual = byId("usual-cost", HTMLOutputElement);
  #stage = byId("search-stage", HTMLElement);
  #stages = byId("search-stages", HTMLElement);
  #figures = byId("search-figures", HTMLElement);
  #step;
  #frame;
  #stop;
  #undo;
  #redo;

  /**
   * @param {import("../model/store.js").Store} store
   * @param {import("../model/actions.js").Actions} actions
   */
  constructor(store, actions) {
    this.#store = store;
    this.#step = button("search-step", () => actions.search("step"));
    this.#frame = button("search-frame", () => actions.search("frame"));
    this.#stop = button("search-stop", () => actions.search("stop"));
    this.#undo = button("undo", () => actions.undo());
    this.#redo = button("redo", () => actions.redo());
    store.on(["session"], () => this.#showSession());
    store.on(["state", "connected", "session"], () => this.#showState());
    store.on(["timeline", "lanes", "session", "state"], () => this.#showUsual());
  }

  #showSession() {
    const { session } = this.#store.facts;
    if (!session) return;
    this.#session.textContent = session.name;
    this.#session.title = `${session.name}. Open another session (Ctrl+O)`;
    document.title = `${session.name} – Quadrille`;
  }

  #showState() {
    const { state, connected } = this.#store.facts;
    const isReady = connected && !!state;
    const isRunning = !!state?.job.running;
    this.#step.disabled = this.#frame.disabled = !isReady || isRunning;
    this.#stop.disabled = !isReady || !hasSearch(state);
    this.#stop.title = stopTitle(isRunning);
    this.#undo.disabled = !isReady || state.undo === null;
    this.#redo.disabled = !isReady || state.redo === null;
    if (!state) return;
    this.#undo.title = state.undo === null ? "Nothing to undo" : `Undo ${state.undo} (Ctrl+Z)`;
    this.#redo.title = state.redo === null ? "Nothing to redo" : `Redo ${state.redo} (Ctrl+Shift+Z)`;
    this.#cost.textContent = state.cost_px === null ? "–" : state.cost_px.toFixed(2);
    if (hasTrack(state) || state.track.message) this.#showTrack(state.track);
    else this.#showJob(state.job);
    const isToBegin = (state.track.running && state.track.done === 0) || (isRunning && state.job.evaluations === 0);
    if (state.compiling && isToBegin) this.#figures.textContent = "waiting for compilation";
  }

  /** Say beside the cost which costs the good frames of this recording have. */
  #showUsual() {
    const usual = usualCosts(personCells(this.#store.facts));
    this.#usual.textContent = usual === null ? "" : `usual here ${usual.map((cost) => cost.toFixed(1)).join("–")}`;
  }

  /** @param {import("../model/protocol.js").Job} job */
  #showJob(job) {
    const isActive = job.running || job.kind !== null;
    const at = isActive && job.stage !== null ? job.stages.indexOf(job.stage) : -1;
    const stage = displayName(job.stage ?? "starting");
    const paused = job.running ? "" : "paused · ";
    this.#stage.textContent = isActive ? `${paused}${stage} · ${count(job.evaluations)} poses` : job.message;
    this.#stage.title = this.#stage.textContent;
    this.#figures.textContent = isActive ? `best ${px(job.best_px)} · ${count(job.per_second)}/s` : "";
    this.#stages.replaceChildren(
      ...(isActive ? job.stages : []).map((_, index) => make("i", index < at ? "is-done" : index === at ? "is-current" : "")),
    );
  }

  /** @param {import("../model/protocol.js").Track} track */
  #showTrack({ running, first, last, at, done, total, per_second, doubtful, lost, stage, message }) {
    const isActive = first !== null;
    const [how, ...rest] = message.split(", ");
    const [work, way] = {
      tracking: [`tracked ${done} of ${total}`, `Frame ${at ?? first}, tracking to frame ${last}`],
      back: ["tracking backward", "Tracking once more from the last frame to the first; you can go on"],
      solve: ["estimating all frames together", "Comparing poses over all frames and cameras; you can go on"],
    }[stage];
    this.#stage.textContent = isActive ? (running ? work : `paused ${done} of ${total}`) : how;
    this.#stage.title = isActive ? way : message;
    const counts = [doubtful && `${doubtful} doubtful`, lost && `${lost} lost`].filter(Boolean);
    const rate = stage !== "tracking" ? "" : per_second > 0 ? `${per_second.toFixed(1)}/s` : done === 0 && "starting";
    const figures = [rate, ...counts].filter(Boolean).join(" · ");
    this.#figures.textContent = isActive ? figures : rest.join(" · ");
    const bar = make("i", { "--done": `${(100 * done) / Math.max(1, total)}%`, className: "is-share" });
    this.#stages.replaceChildren(...(isActive ? [bar] : []));
  }
}
