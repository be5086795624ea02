/** Search tab of the drawer: its controls, and the views below them. */

import { hasSearch, hasTrack, stopTitle } from "../model/selectors.js";
import { mountCandidateStrip } from "./candidate_strip.js";
import { mountCostCurve } from "./cost_curve.js";
import { byId, make, onChange, textButton } from "../widgets/elements.js";
import { mountReplayBar } from "./replay_bar.js";
import { mountRunList } from "./run_list.js";
import { mountSearchTree } from "./search_tree.js";
import { makeNumber } from "./search_widgets.js";
import { selectedRun } from "../model/search_runs.js";
import { count, px } from "../widgets/text.js";

/** Speeds in expansions per second; 0 for no limit. */
const SPEEDS = [1, 2, 5, 10, 30, 0];
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
  const buttons = makeButtons();
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

  function makeButtons() {
    const search = (/** @type {"step" | "stage" | "frame" | "contours" | "chains" | "stop"} */ action) => () => actions.search(action);
    const track = () => (hasTrack(store.facts.state) ? actions.togglePause() : actions.track("forward"));
    return {
      step: textButton("Step", "Run one expansion of the search (S)", search("step")),
      stage: textButton("Stage", "Run to the end of the current stage", search("stage")),
      frame: textButton("Frame", "Run the whole search of this frame (F)", search("frame")),
      contours: textButton(
        "Contours",
        "Fit the contours of this frame by Gauss-Newton; each iteration can be replayed",
        search("contours"),
      ),
      chains: textButton(
        "Chains",
        "Fit the contours of a rough pose chain by chain: root, trunk, each limb, then the whole body; each iteration can be replayed",
        search("chains"),
      ),
      again: textButton("Rerun", "Repeat the selected run from its start pose with the current settings", () =>
        actions.searchAgain(),
      ),
      track: textButton("Track", "Track forward from this frame, pause or continue (T)", track),
      stop: textButton("Stop", "Stop the search or tracking and keep the best pose (Esc)", () =>
        hasTrack(store.facts.state) ? actions.stopTracking() : actions.search("stop"),
      ),
    };
  }

  function build() {
    const group = make("div", { className: "group", role: "group", "aria-label": "Search" }, ...Object.values(buttons));
    const title = "Search speed in expansions per second. Changes take effect immediately";
    onChange(speedField, () => send({ type: "search_speed", per_second: Number(speedField.value) || null }));
    controls.append(group, make("label", { className: "search-field", title }, "Speed", speedField), theta.element, figures);
  }

  /** @param {Record<string, unknown>} changes */
  function set(changes) {
    send({ type: "search_settings", changes });
  }

  function show() {
    const { state, connected, settings, searchSetup } = store.facts;
    const isReady = connected && !!state;
    const isRunning = !!state?.job.running;
    const { step, stage, frame, contours, chains, again, track, stop } = buttons;
    step.disabled = stage.disabled = frame.disabled = contours.disabled = chains.disabled = !isReady || isRunning;
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
