/** Search tab of the drawer: its controls, and the views below them. */

import { hasSearch, hasTrack, stopTitle } from "../model/selectors.js";
import { CandidateStrip } from "./candidate_strip.js";
import { CostCurve } from "./cost_curve.js";
import { byId, make, onChange, textButton } from "../widgets/elements.js";
import { ReplayBar } from "./replay_bar.js";
import { RunList } from "./run_list.js";
import { SearchTree } from "./search_tree.js";
import { makeNumber } from "./search_widgets.js";
import { selectedRun } from "../model/search_runs.js";
import { count, px } from "../widgets/text.js";

/** Speeds in expansions per second; 0 for no limit. */
const SPEEDS = [1, 2, 5, 10, 30, 0];
/** Why the cost changes when a search ends. */
const MEASURED = "The cost uses the edges near the start pose; the final cost in the top bar may differ";

export class SearchPanel {
  #store;
  #actions;
  #send;
  #panel = byId("search-panel", HTMLElement);
  #controls = byId("search-controls", HTMLElement);
  #speed = make("select");
  #figures = make("output");
  #buttons;
  #theta;
  #isOpen = false;

  /**
   * @param {import("../model/store.js").Store} store
   * @param {import("../model/actions.js").Actions} actions
   * @param {(message: import("../model/protocol.js").ClientMessage) => void} send
   */
  constructor(store, actions, send) {
    this.#store = store;
    this.#actions = actions;
    this.#send = send;
    this.#buttons = this.#makeButtons();
    this.#theta = makeNumber({
      label: "θ, px",
      title: "Outlier distance theta in pixels: edges farther away are ignored. Empty: 3% of the longer image side",
      placeholder: "auto",
      change: (value) => this.#set({ theta_px: value }),
    });
    this.#build();
    const views = [
      new SearchTree(store, (changes) => this.#set(changes)),
      new CostCurve(store, send),
      new RunList(store, send),
      new ReplayBar(store, send),
      new CandidateStrip(store, send),
    ];
    store.subscribe((changed) => {
      if (changed.has("drawer")) this.#open();
      if (!this.#isOpen) return;
      if (changed.has("connected") && store.facts.connected) send({ type: "watch", tab: "search" });
      if (["state", "connected", "settings", "searchSetup", "searchRuns", "searchRun"].some((f) => changed.has(/** @type {"state"} */ (f)))) {
        this.#show();
      }
      for (const view of views) view.update(changed);
    });
    this.#open();
  }

  #makeButtons() {
    const { actions, store } = { actions: this.#actions, store: this.#store };
    const search = (/** @type {"step" | "stage" | "frame" | "contours" | "chains" | "stop"} */ action) => () => actions.search(action);
    const track = () => (hasTrack(store.facts.state) ? actions.togglePause() : actions.track("forward"));
    return {
      step: textButton("Step", "Run one expansion of the search (S)", search("step")),
      stage: textButton("Stage", "Run to the end of the current stage (Shift+S)", search("stage")),
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
      again: textButton("Rerun", "Repeat the selected run from its start pose with the current settings (Shift+F)", () =>
        actions.searchAgain(),
      ),
      track: textButton("Track", "Track forward from this frame (T); pause or continue (Alt+P)", track),
      stop: textButton("Stop", "Stop the search or tracking and keep the best pose (Esc)", () =>
        hasTrack(store.facts.state) ? actions.stopTracking() : actions.search("stop"),
      ),
    };
  }

  #build() {
    const group = make("div", { className: "group", role: "group", "aria-label": "Search" }, ...Object.values(this.#buttons));
    const speed = make("label", { className: "search-field", title: "Search speed in expansions per second. Changes take effect immediately" });
    this.#speed.append(...SPEEDS.map((one) => new Option(one ? `${one}/s` : "full", String(one))));
    this.#speed.setAttribute("aria-label", "Expansions per second");
    onChange(this.#speed, () => this.#send({ type: "search_speed", per_second: Number(this.#speed.value) || null }));
    speed.append("Speed", this.#speed);
    this.#figures.className = "search-figures";
    this.#figures.setAttribute("aria-label", "Progress of the search");
    this.#controls.append(group, speed, this.#theta.element, this.#figures);
  }

  #open() {
    const { drawer, connected } = this.#store.facts;
    const isOpen = drawer === "search";
    this.#panel.hidden = this.#controls.hidden = !isOpen;
    if (isOpen === this.#isOpen) return;
    this.#isOpen = isOpen;
    if (!isOpen && connected) this.#actions.leaveReplay();
    if (connected && (isOpen || drawer !== "landscape")) this.#send({ type: "watch", tab: isOpen ? "search" : null });
    if (isOpen) this.#show();
  }

  /** @param {Record<string, unknown>} changes */
  #set(changes) {
    this.#send({ type: "search_settings", changes });
  }

  #show() {
    const { state, connected, settings, searchSetup } = this.#store.facts;
    const isReady = connected && !!state;
    const isRunning = !!state?.job.running;
    const { step, stage, frame, contours, chains, again, track, stop } = this.#buttons;
    step.disabled = stage.disabled = frame.disabled = contours.disabled = chains.disabled = !isReady || isRunning;
    const run = selectedRun(this.#store.facts);
    again.disabled = !isReady || isRunning || run === null;
    track.disabled = !isReady;
    track.textContent = state?.track.running ? "Pause" : "Track";
    stop.disabled = !isReady || !(hasSearch(state) || hasTrack(state));
    stop.title = hasTrack(state) ? "Stop tracking and keep the results (Esc)" : stopTitle(isRunning);
    if (settings) this.#theta.show(settings.search.theta_px);
    if (searchSetup) {
      if (document.activeElement !== this.#speed) this.#speed.value = String(searchSetup.speed ?? 0);
    }
    const rate = run && run.seconds > 0 ? ` · ${count(run.evaluations / run.seconds)}/s` : "";
    this.#figures.textContent = run ? `${count(run.evaluations)} poses${rate} · best ${px(run.best_px)}` : "No search";
    this.#figures.title = run ? `Run ${run.number}: poses evaluated, poses per second, lowest cost. ${MEASURED}` : "";
  }
}
