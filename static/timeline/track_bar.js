/** Buttons for tracking. */

import { hasTrack } from "../model/selectors.js";
import { button, byId, onChange } from "../widgets/elements.js";

/**
 * @param {import("../model/store.js").Store} store
 * @param {import("../model/actions.js").Actions} actions
 */
export function mountTrackBar(store, actions) {
  const follow = byId("follow", HTMLInputElement);
  const back = button("track-backward", () => actions.track("backward"));
  const forwardButton = button("track-forward", () => actions.track("forward"));
  const pause = button("track-pause", () => actions.togglePause());
  const stop = button("track-stop", () => actions.stopTracking());
  onChange(follow, () => actions.follow(follow.checked));
  store.on(["state", "connected", "range"], showRun);

  function showRun() {
    const { state, connected, range } = store.facts;
    const isActive = hasTrack(state);
    const isRunning = !!state?.track.running;
    back.disabled = forwardButton.disabled = !connected || !state || isRunning;
    pause.disabled = stop.disabled = follow.disabled = !connected || !isActive;
    const to = range ? "to the end of the marked range" : "to the end of the recording";
    forwardButton.title = `Track forward from this frame ${to} (T)`;
    back.title = `Track backward from this frame ${range ? to : "to its beginning"} (Shift+T)`;
    pause.classList.toggle("is-paused", isActive && !isRunning);
    pause.title = isActive && !isRunning ? "Continue tracking" : "Pause tracking";
    pause.setAttribute("aria-label", isActive && !isRunning ? "Continue tracking" : "Pause tracking");
    follow.checked = state?.follow ?? true;
  }
}
