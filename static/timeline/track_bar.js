/** Buttons for tracking. */

import { hasTrack } from "../model/selectors.js";
import { button, byId, onChange } from "../widgets/elements.js";

export class TrackBar {
  #store;
  #back;
  #forward;
  #pause;
  #stop;
  #follow = byId("follow", HTMLInputElement);

  /**
   * @param {import("../model/store.js").Store} store
   * @param {import("../model/actions.js").Actions} actions
   */
  constructor(store, actions) {
    this.#store = store;
    this.#back = button("track-backward", () => actions.track("backward"));
    this.#forward = button("track-forward", () => actions.track("forward"));
    this.#pause = button("track-pause", () => actions.togglePause());
    this.#stop = button("track-stop", () => actions.stopTracking());
    onChange(this.#follow, () => actions.follow(this.#follow.checked));
    store.on(["state", "connected", "range"], () => this.#showRun());
  }

  #showRun() {
    const { state, connected, range } = this.#store.facts;
    const isActive = hasTrack(state);
    const isRunning = !!state?.track.running;
    this.#back.disabled = this.#forward.disabled = !connected || !state || isRunning;
    this.#pause.disabled = this.#stop.disabled = this.#follow.disabled = !connected || !isActive;
    const to = range ? "to the end of the marked range" : "to the end of the recording";
    this.#forward.title = `Track forward from this frame ${to} (T)`;
    this.#back.title = `Track backward from this frame ${range ? to : "to its beginning"} (Shift+T)`;
    this.#pause.classList.toggle("is-paused", isActive && !isRunning);
    this.#pause.title = isActive && !isRunning ? "Continue tracking (Alt+P)" : "Pause tracking (Alt+P)";
    this.#pause.setAttribute("aria-label", isActive && !isRunning ? "Continue tracking" : "Pause tracking");
    this.#follow.checked = state?.follow ?? true;
  }
}
