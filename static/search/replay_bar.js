/** Replay of the selected run, forward and backward. The stored pose does not change. */

import { byId, iconButton, make, textButton } from "../widgets/elements.js";
import { selectedRun } from "../model/search_runs.js";

const STEPS_PER_S = 12;

/**
 * @param {import("../model/store.js").Store} store
 * @param {(message: import("../model/protocol.js").ClientMessage) => void} send
 */
export function mountReplayBar(store, send) {
  const text = make("output", "replay-text is-clipped");
  /** @type {ReturnType<typeof setInterval> | null} */
  let timer = null;
  /** The step requested last. The program's answer may still be pending. */
  let requested = -1;
  const go = (/** @type {number} */ by) => () => goTo(getAt() + by);
  const play = iconButton("M5 3v10l8-5z", "Replay the search", () => togglePlay());
  const buttons = [
    iconButton("M4 3.5v9M12.5 3.5 6.5 8l6 4.5z", "Start of the search", () => goTo(-1)),
    iconButton("M10 3.5 5 8l5 4.5", "One step back", go(-1)),
    play,
    iconButton("m6 3.5 5 4.5-5 4.5", "One step forward", go(1)),
    iconButton("M12 3.5v9M3.5 3.5l6 4.5-6 4.5z", "Last step of the search", () => goTo(Infinity)),
  ];
  const title = "Drag to replay the search; arrow keys move by one step";
  const slider = make("input", { type: "range", min: "-1", title, "aria-label": "Step of the search" });
  slider.addEventListener("input", () => goTo(Number(slider.value)));
  const leave = textButton("Exit", "Exit the replay and show the current pose (Esc)", () => {
    pause();
    send({ type: "replay", run: null, step: 0 });
  });
  byId("replay-bar", HTMLElement).append(make("div", "group", ...buttons), slider, text, leave);

  store.onTab("search", ["searchRuns", "searchRun", "searchSteps"], show);

  function show() {
    const { searchRuns } = store.facts;
    const run = selectedRun(store.facts);
    const replay = searchRuns?.replay ?? null;
    const isReady = !!run && run.steps > 0 && run.state !== "running";
    slider.disabled = !isReady;
    for (const one of buttons) one.disabled = !isReady;
    leave.disabled = !replay;
    if (!replay || !isReady) pause();
    slider.max = String((run?.steps ?? 0) - 1);
    slider.value = String(replay ? replay.step : (run?.steps ?? 0) - 1);
    if (replay) {
      const best = replay.best_px === null ? "" : ` · best ${replay.best_px.toFixed(2)} px`;
      text.textContent = `${replay.step + 1} of ${run?.steps ?? 0}`;
      text.title = `${replay.stage ?? "start"}, ${replay.evaluations} poses evaluated${best}`;
    } else {
      text.textContent = run && isReady ? `${run.steps} steps` : "";
      const thinned = run?.thinned ? ". Long searches keep only some of their steps" : "";
      text.title = `Steps that can be replayed${thinned}`;
    }
  }

  function getAt() {
    const replay = store.facts.searchRuns?.replay;
    if (timer !== null) return requested;
    return replay ? replay.step : (selectedRun(store.facts)?.steps ?? 0) - 1;
  }

  /** @param {number} step */
  function goTo(step) {
    const run = selectedRun(store.facts);
    if (!run) return;
    requested = Math.max(-1, Math.min(run.steps - 1, step));
    send({ type: "replay", run: run.number, step: requested });
  }

  function togglePlay() {
    if (timer !== null) {
      pause();
      return;
    }
    const run = selectedRun(store.facts);
    if (!run) return;
    const at = getAt();
    goTo(at >= run.steps - 1 ? -1 : at);
    store.set({ replaying: true });
    timer = setInterval(() => {
      if (!store.facts.replaying) {
        pause();
        return;
      }
      goTo(requested + 1);
      if (requested >= (selectedRun(store.facts)?.steps ?? 0) - 1) pause();
    }, 1000 / STEPS_PER_S);
    play.setAttribute("aria-pressed", "true");
  }

  function pause() {
    if (timer === null) return;
    clearInterval(timer);
    store.set({ replaying: false });
    timer = null;
    play.setAttribute("aria-pressed", "false");
  }
}
