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

/**
 * @param {import("../model/store.js").Store} store
 * @param {import("../model/actions.js").Actions} actions
 * @param {() => void} openComparison
 */
export function mountRangeBar(store, actions, openComparison) {
  const bar = byId("range-bar", HTMLElement);
  const text = byId("range-text", HTMLElement);
  const workText = byId("range-work", HTMLElement);
  const scope = byId("range-scope", HTMLSelectElement);
  /** Message of the work that ended before this range was marked. */
  let old = "";
  const buttons = BUTTONS.map(([id, action]) => button(id, () => act(action)));
  buttons.push(
    button("range-compare", () => {
      actions.compareRange(true);
      openComparison();
    }),
  );
  const stop = button("range-stop", () => actions.stopRange());
  button("range-close", () => store.set({ range: null }));
  scope.addEventListener("change", () => scope.blur());
  store.on(["session"], listPeople);
  store.on(["range"], () => (old = store.facts.state?.range?.message ?? ""));
  store.on(["range", "state", "connected", "session"], show);
  store.on(["range", "visible", "session"], place);
  addEventListener("resize", () => place());

  /** @param {import("../model/protocol.js").RangeAction} action */
  function act(action) {
    old = "";
    actions.onRange(action, scope.value === "one" ? (store.facts.state?.person ?? 0) : null);
  }

  function listPeople() {
    scope.hidden = (store.facts.session?.people.length ?? 1) < 2;
    if (scope.hidden) scope.value = "all";
  }

  function show() {
    const { range, state, connected, session } = store.facts;
    bar.hidden = !range;
    if (!range) return;
    const work = state?.range;
    const n = range.last - range.first + 1;
    text.textContent = n === 1 ? `Frame ${range.first}` : `Frames ${range.first} – ${range.last}`;
    text.title = `${count(n)} frame${n === 1 ? "" : "s"}`;
    const isBusy = !!work?.running;
    if (isBusy) old = "";
    for (const one of buttons) one.disabled = !connected || isBusy || !!state?.track.running;
    stop.disabled = !connected || !isBusy;
    stop.hidden = !isBusy;
    const message = work?.message === old ? "" : (work?.message ?? "");
    workText.textContent = isBusy
      ? `${work.what} ${count(work.done)} of ${count(work.total)}`
      : message || `${count(n)} frame${n === 1 ? "" : "s"}`;
    const one = session?.people[state?.person ?? 0]?.name ?? "";
    const option = scope.options[1];
    if (option.textContent !== `Only ${one}`) option.textContent = `Only ${one}`;
    place();
  }

  /** Centre the bar over the range, within the window. */
  function place() {
    const { range, session, visible } = store.facts;
    if (!range || !session) return;
    const width = document.documentElement.clientWidth;
    const axis = new FrameAxis(width, session.n_frames, visible);
    const middle = (axis.start(range.first) + axis.start(range.last + 1)) / 2;
    const half = bar.offsetWidth / 2;
    bar.style.left = `${Math.round(Math.max(8, Math.min(width - 2 * half - 8, middle - half)))}px`;
  }
}
