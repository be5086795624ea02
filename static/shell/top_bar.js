/** Top bar: session, search or tracking progress, cost, undo and redo. */

import { usualCosts } from "../model/cells.js";
import { hasSearch, hasTrack, personCells, stopTitle } from "../model/selectors.js";
import { button, byId, make } from "../widgets/elements.js";
import { count, displayName, px } from "../widgets/text.js";

/**
 * @param {import("../model/store.js").Store} store
 * @param {import("../model/actions.js").Actions} actions
 */
export function mountTopBar(store, actions) {
  const sessionName = byId("session-name", HTMLElement);
  const cost = byId("cost", HTMLElement);
  const usualCost = byId("usual-cost", HTMLOutputElement);
  const stageLine = byId("search-stage", HTMLElement);
  const stageMarks = byId("search-stages", HTMLElement);
  const figureLine = byId("search-figures", HTMLElement);
  const step = button("search-step", () => actions.search("step"));
  const frame = button("search-frame", () => actions.search("frame"));
  const stop = button("search-stop", () => actions.search("stop"));
  const undo = button("undo", () => actions.undo());
  const redo = button("redo", () => actions.redo());
  store.on(["session"], showSession);
  store.on(["state", "connected", "session"], showState);
  store.on(["timeline", "lanes", "session", "state"], showUsual);

  function showSession() {
    const { session } = store.facts;
    if (!session) return;
    sessionName.textContent = session.name;
    sessionName.title = `${session.name}. Open another session (Ctrl+O)`;
    document.title = `${session.name} – Quadrille`;
  }

  function showState() {
    const { state, connected } = store.facts;
    const isReady = connected && !!state;
    const isRunning = !!state?.job.running;
    step.disabled = frame.disabled = !isReady || isRunning;
    stop.disabled = !isReady || !hasSearch(state);
    stop.title = stopTitle(isRunning);
    undo.disabled = !isReady || state.undo === null;
    redo.disabled = !isReady || state.redo === null;
    if (!state) return;
    undo.title = state.undo === null ? "Nothing to undo" : `Undo ${state.undo} (Ctrl+Z)`;
    redo.title = state.redo === null ? "Nothing to redo" : `Redo ${state.redo} (Ctrl+Shift+Z)`;
    cost.textContent = state.cost_px === null ? "–" : state.cost_px.toFixed(2);
    if (hasTrack(state) || state.track.message) showTrack(state.track);
    else showJob(state.job);
    const isToBegin = (state.track.running && state.track.done === 0) || (isRunning && state.job.evaluations === 0);
    if (state.compiling && isToBegin) figureLine.textContent = "waiting for compilation";
  }

  /** Say beside the cost which costs the good frames of this recording have. */
  function showUsual() {
    const usual = usualCosts(personCells(store.facts));
    usualCost.textContent = usual === null ? "" : `usual here ${usual.map((cost) => cost.toFixed(1)).join("–")}`;
  }

  /** @param {import("../model/protocol.js").Job} job */
  function showJob(job) {
    const isActive = job.running || job.kind !== null;
    const at = isActive && job.stage !== null ? job.stages.indexOf(job.stage) : -1;
    const stage = displayName(job.stage ?? "starting");
    const paused = job.running ? "" : "paused · ";
    stageLine.textContent = isActive ? `${paused}${stage} · ${count(job.evaluations)} poses` : job.message;
    stageLine.title = stageLine.textContent;
    figureLine.textContent = isActive ? `best ${px(job.best_px)} · ${count(job.per_second)}/s` : "";
    stageMarks.replaceChildren(
      ...(isActive ? job.stages : []).map((_, index) => make("i", index < at ? "is-done" : index === at ? "is-current" : "")),
    );
  }

  /** @param {import("../model/protocol.js").Track} track */
  function showTrack({ running, first, last, at, done, total, per_second, doubtful, lost, stage, message }) {
    const isActive = first !== null;
    const [how, ...rest] = message.split(", ");
    const [work, way] = {
      tracking: [`tracked ${done} of ${total}`, `Frame ${at ?? first}, tracking to frame ${last}`],
      back: ["tracking backward", "Tracking once more from the last frame to the first; you can go on"],
      solve: ["estimating all frames together", "Comparing poses over all frames and cameras; you can go on"],
    }[stage];
    stageLine.textContent = isActive ? (running ? work : `paused ${done} of ${total}`) : how;
    stageLine.title = isActive ? way : message;
    const counts = [doubtful && `${doubtful} doubtful`, lost && `${lost} lost`].filter(Boolean);
    const rate = stage !== "tracking" ? "" : per_second > 0 ? `${per_second.toFixed(1)}/s` : done === 0 && "starting";
    const figures = [rate, ...counts].filter(Boolean).join(" · ");
    figureLine.textContent = isActive ? figures : rest.join(" · ");
    const bar = make("i", { "--done": `${(100 * done) / Math.max(1, total)}%`, className: "is-share" });
    stageMarks.replaceChildren(...(isActive ? [bar] : []));
  }
}
