/** Search tab of the drawer: its controls, and the views below them. */

import { hasSearch, hasTrack, stopTitle } from "../model/selectors.js";
import { mountCandidateStrip } from "./candidate_strip.js";
import { mountCostCurve } from "./cost_curve.js";
import { button, byId, make, onChange } from "../widgets/elements.js";
import { mountReplayBar } from "./replay_bar.js";
import { mountRunList } from "./run_list.js";
import { mountSearchTree } from "./search_tree.js";
import { makeNumber } from "./search_widgets.js";
import { selectedRun } from "../model/search_runs.js";
import { count, px } from "../widgets/text.js";

/** Speeds in expansions per second; 0 for no limit. */
const SPEEDS = [1, 2, 5, 10, 30, 0];
/** Searches that its buttons start. */
const STARTS = /** @type {const} */ (["step", "stage", "frame", "contours", "chains"]);
/** Why the cost changes when a search ends. */
const MEASURED = "The cost uses the edges near the start pose; the final cost in the top bar may differ";

/**
 * @param {import("../model/store.js").Store} store
 * @param {import("../model/actions.js").Actions} actions
 * @param {(message: import("../model/protocol.js").ClientMessage) => void} send
 */
export function mountSearchPanel(store, actions, send) {
  const controls = byId("search-controls", HTMLElement);
  const speedField = make("select", { "aria-label": "Expansions per second" }, ...SPEEDS.map((one) => new Option(one ? `${one}/s` : "full", String(one))));
  const figures = make("output", { className: "search-figures", "aria-label": "Progress of the search" });
  let wasOpen = false;
  const starts = STARTS.map((action) => button(`panel-${action}`, () => actions.search(action)));
  const again = button("panel-again", () => actions.searchAgain());
  const track = button("panel-track", () => (hasTrack(store.facts.state) ? actions.togglePause() : actions.track("forward")));
  const stop = button("panel-stop", () => (hasTrack(store.facts.state) ? actions.stopTracking() : actions.search("stop")));
  const limiting = "Outlier distance theta in pixels: edges farther away are ignored. Empty: 3% of the longer image side";
  const theta = makeNumber("θ, px", limiting, (value) => set({ theta_px: value }), "auto");
  build();
  store.on(["drawer"], () => {
    const isOpen = store.facts.drawer === "search";
    if (wasOpen && !isOpen && store.facts.connected) actions.leaveReplay();
    wasOpen = isOpen;
  });
  store.onTab("search", ["state", "connected", "settings", "searchSetup", "searchRuns", "searchRun"], show);
  mountSearchTree(store, (changes) => set(changes));
  mountCostCurve(store, send);
  mountRunList(store, send);
  mountReplayBar(store, send);
  mountCandidateStrip(store, send);

  function build() {
    const title = "Search speed in expansions per second. Changes take effect immediately";
    onChange(speedField, () => send({ type: "search_speed", per_second: Number(speedField.value) || null }));
    controls.append(make("label", { className: "search-field", title }, "Speed", speedField), theta.element, figures);
  }

  /** @param {Record<string, unknown>} changes */
  function set(changes) {
    send({ type: "search_settings", changes });
  }

  function show() {
    const { state, connected, settings, searchSetup } = store.facts;
    const isReady = connected && !!state;
    const isRunning = !!state?.job.running;
    for (const start of starts) start.disabled = !isReady || isRunning;
    const run = selectedRun(store.facts);
    again.disabled = !isReady || isRunning || run === null;
    track.disabled = !isReady;
    track.textContent = state?.track.running ? "Pause" : "Track";
    stop.disabled = !isReady || !(hasSearch(state) || hasTrack(state));
    stop.title = hasTrack(state) ? "Stop tracking and keep the results (Esc)" : stopTitle(isRunning);
    if (settings) theta.show(settings.search.theta_px);
    if (searchSetup && document.activeElement !== speedField) speedField.value = String(searchSetup.speed ?? 0);
    const rate = run && run.seconds > 0 ? ` · ${count(run.evaluations / run.seconds)}/s` : "";
    figures.textContent = run ? `${count(run.evaluations)} poses${rate} · best ${px(run.best_px)}` : "No search";
    figures.title = run ? `Run ${run.number}: poses evaluated, poses per second, lowest cost. ${MEASURED}` : "";
  }
}
