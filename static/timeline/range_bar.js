/** Bar over the marked range: actions, progress and result. */

import { button, byId } from "../widgets/elements.js";
import { FrameAxis } from "../widgets/frame_axis.js";
import { count } from "../widgets/text.js";

/** @type {[string, import("../model/protocol.js").RangeAction][]} */
const BUTTONS = [
  ["range-backward", "track_backward"],
  ["range-forward", "track_forward"],
  ["range-interpolate", "interpolate"],
  ["range-estimate", "estimate"],
  ["range-clear", "clear"],
  ["range-keyframe", "keyframe"],
  ["range-reviewed", "reviewed"],
  ["range-unreviewed", "unreviewed"],
];

export class RangeBar {
  #store;
  #actions;
  #bar = byId("range-bar", HTMLElement);
  #text = byId("range-text", HTMLElement);
  #work = byId("range-work", HTMLElement);
  #scope = byId("range-scope", HTMLSelectElement);
  #buttons;
  #stop;
  /** Message of the work that ended before this range was marked. */
  #old = "";

  /**
   * @param {import("../model/store.js").Store} store
   * @param {import("../model/actions.js").Actions} actions
   * @param {() => void} openComparison
   */
  constructor(store, actions, openComparison) {
    this.#store = store;
    this.#actions = actions;
    this.#buttons = BUTTONS.map(([id, action]) => button(id, () => this.#act(action)));
    this.#buttons.push(
      button("range-compare", () => {
        actions.compareRange(true);
        openComparison();
      }),
    );
    this.#stop = button("range-stop", () => actions.stopRange());
    button("range-close", () => store.set({ range: null }));
    this.#scope.addEventListener("change", () => this.#scope.blur());
    store.on(["session"], () => this.#listPeople());
    store.on(["range"], () => (this.#old = store.facts.state?.range?.message ?? ""));
    store.on(["range", "state", "connected", "session"], () => this.#show());
    store.on(["range", "visible", "session"], () => this.#place());
    addEventListener("resize", () => this.#place());
  }

  /** @param {import("../model/protocol.js").RangeAction} action */
  #act(action) {
    this.#old = "";
    this.#actions.onRange(action, this.#scope.value === "one" ? (this.#store.facts.state?.person ?? 0) : null);
  }

  #listPeople() {
    this.#scope.hidden = (this.#store.facts.session?.people.length ?? 1) < 2;
    if (this.#scope.hidden) this.#scope.value = "all";
  }

  #show() {
    const { range, state, connected, session } = this.#store.facts;
    this.#bar.hidden = !range;
    if (!range) return;
    const work = state?.range;
    const n = range.last - range.first + 1;
    this.#text.textContent = n === 1 ? `Frame ${range.first}` : `Frames ${range.first} – ${range.last}`;
    this.#text.title = `${count(n)} frame${n === 1 ? "" : "s"}`;
    const isBusy = !!work?.running;
    if (isBusy) this.#old = "";
    for (const one of this.#buttons) one.disabled = !connected || isBusy || !!state?.track.running;
    this.#stop.disabled = !connected || !isBusy;
    this.#stop.hidden = !isBusy;
    const message = work?.message === this.#old ? "" : (work?.message ?? "");
    this.#work.textContent = isBusy
      ? `${work.what} ${count(work.done)} of ${count(work.total)}`
      : message || `${count(n)} frame${n === 1 ? "" : "s"}`;
    const one = session?.people[state?.person ?? 0]?.name ?? "";
    const option = this.#scope.options[1];
    if (option.textContent !== `Only ${one}`) option.textContent = `Only ${one}`;
    this.#place();
  }

  /** Centre the bar over the range, within the window. */
  #place() {
    const { range, session, visible } = this.#store.facts;
    if (!range || !session) return;
    const width = document.documentElement.clientWidth;
    const axis = new FrameAxis(width, session.n_frames, visible);
    const middle = (axis.start(range.first) + axis.start(range.last + 1)) / 2;
    const half = this.#bar.offsetWidth / 2;
    this.#bar.style.left = `${Math.round(Math.max(8, Math.min(width - 2 * half - 8, middle - half)))}px`;
  }
}
