/** Replay of the selected run, forward and backward. The stored pose does not change. */

import { byId, iconButton, make, textButton } from "../widgets/elements.js";
import { selectedRun } from "../model/search_runs.js";

const STEPS_PER_S = 12;

export class ReplayBar {
  #store;
  #send;
  #slider;
  #text = make("output", "replay-text is-clipped");
  #buttons;
  #leave;
  #play;
  /** @type {ReturnType<typeof setInterval> | null} */
  #timer = null;
  /** The step requested last. The program's answer may still be pending. */
  #requested = -1;

  /**
   * @param {import("../model/store.js").Store} store
   * @param {(message: import("../model/protocol.js").ClientMessage) => void} send
   */
  constructor(store, send) {
    this.#store = store;
    this.#send = send;
    const go = (/** @type {number} */ by) => () => this.#goTo(this.#at + by);
    this.#play = iconButton("M5 3v10l8-5z", "Replay the search", () => this.#togglePlay());
    this.#buttons = [
      iconButton("M4 3.5v9M12.5 3.5 6.5 8l6 4.5z", "Start of the search", () => this.#goTo(-1)),
      iconButton("M10 3.5 5 8l5 4.5", "One step back", go(-1)),
      this.#play,
      iconButton("m6 3.5 5 4.5-5 4.5", "One step forward", go(1)),
      iconButton("M12 3.5v9M3.5 3.5l6 4.5-6 4.5z", "Last step of the search", () => this.#goTo(Infinity)),
    ];
    const title = "Drag to replay the search; arrow keys move by one step";
    const slider = make("input", { type: "range", min: "-1", title, "aria-label": "Step of the search" });
    this.#slider = slider;
    slider.addEventListener("input", () => this.#goTo(Number(slider.value)));
    this.#leave = textButton("Exit", "Exit the replay and show the current pose (Esc)", () => {
      this.#pause();
      this.#send({ type: "replay", run: null, step: 0 });
    });
    byId("replay-bar", HTMLElement).append(make("div", "group", ...this.#buttons), slider, this.#text, this.#leave);
  }

  /** @param {Set<keyof import("../model/store.js").Facts>} changed */
  update(changed) {
    if (!["drawer", "searchRuns", "searchRun", "searchSteps"].some((f) => changed.has(/** @type {"drawer"} */ (f)))) return;
    const { searchRuns } = this.#store.facts;
    const run = selectedRun(this.#store.facts);
    const replay = searchRuns?.replay ?? null;
    const isReady = !!run && run.steps > 0 && run.state !== "running";
    this.#slider.disabled = !isReady;
    for (const one of this.#buttons) one.disabled = !isReady;
    this.#leave.disabled = !replay;
    if (!replay || !isReady) this.#pause();
    this.#slider.max = String((run?.steps ?? 0) - 1);
    this.#slider.value = String(replay ? replay.step : (run?.steps ?? 0) - 1);
    if (replay) {
      const best = replay.best_px === null ? "" : ` · best ${replay.best_px.toFixed(2)} px`;
      this.#text.textContent = `${replay.step + 1} of ${run?.steps ?? 0}`;
      this.#text.title = `${replay.stage ?? "start"}, ${replay.evaluations} poses evaluated${best}`;
    } else {
      this.#text.textContent = run && isReady ? `${run.steps} steps` : "";
      const thinned = run?.thinned ? ". Long searches keep only some of their steps" : "";
      this.#text.title = `Steps that can be replayed${thinned}`;
    }
  }

  get #at() {
    const replay = this.#store.facts.searchRuns?.replay;
    if (this.#timer !== null) return this.#requested;
    return replay ? replay.step : (selectedRun(this.#store.facts)?.steps ?? 0) - 1;
  }

  /** @param {number} step */
  #goTo(step) {
    const run = selectedRun(this.#store.facts);
    if (!run) return;
    this.#requested = Math.max(-1, Math.min(run.steps - 1, step));
    this.#send({ type: "replay", run: run.number, step: this.#requested });
  }

  #togglePlay() {
    if (this.#timer !== null) {
      this.#pause();
      return;
    }
    const run = selectedRun(this.#store.facts);
    if (!run) return;
    const at = this.#at;
    this.#goTo(at >= run.steps - 1 ? -1 : at);
    this.#store.set({ replaying: true });
    this.#timer = setInterval(() => {
      if (!this.#store.facts.replaying) {
        this.#pause();
        return;
      }
      this.#goTo(this.#requested + 1);
      if (this.#requested >= (selectedRun(this.#store.facts)?.steps ?? 0) - 1) this.#pause();
    }, 1000 / STEPS_PER_S);
    this.#play.setAttribute("aria-pressed", "true");
  }

  #pause() {
    if (this.#timer === null) return;
    clearInterval(this.#timer);
    this.#store.set({ replaying: false });
    this.#timer = null;
    this.#play.setAttribute("aria-pressed", "false");
  }
}
