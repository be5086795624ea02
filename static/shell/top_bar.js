/** Top bar: session, search, cost, undo and redo. */

import { usualCosts } from "../model/cells.js";
import { hasSearch, personCells, stopTitle } from "../model/selectors.js";
import { button, byId } from "../widgets/elements.js";

/**
 * @param {import("../model/store.js").Store} store
 * @param {import("../model/actions.js").Actions} actions
 */
export function mountTopBar(store, actions) {
  const sessionName = byId("session-name", HTMLElement);
  const cost = byId("cost", HTMLElement);
  const usualCost = byId("usual-cost", HTMLOutputElement);
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
    sessionName.title = `${session.name}. Open another session`;
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
  }

  /** Say beside the cost which costs the good frames of this recording have. */
  function showUsual() {
    const usual = usualCosts(personCells(store.facts));
    usualCost.textContent = usual === null ? "" : `usual here ${usual.map((cost) => cost.toFixed(1)).join("–")}`;
  }
}
