/** Keys of navigation, tracking, timeline and drawer. */

import { command, inArea } from "../widgets/key_matching.js";
import { KINDS } from "./jumps.js";

/**
 * @typedef {import("../widgets/key_matching.js").Command} Command
 * @typedef {import("../model/store.js").Store} Store
 * @typedef {import("../model/actions.js").Actions} Actions
 * @typedef {import("../model/unavailable_reasons.js").Reasons} Reasons
 * @typedef {import("./playback.js").Playback} Playback
 */

/**
 * @param {import("../model/navigation.js").Navigation} navigation
 * @param {Playback} playback
 */
export function frameBindings(navigation, playback) {
  return inArea("Frames", [
    { keys: [","], label: "Previous frame", run: () => navigation.step(-1) },
    { keys: ["."], label: "Next frame", run: () => navigation.step(1) },
    { keys: ["Shift ,"], label: "Ten frames back", run: () => navigation.step(-10) },
    { keys: ["Shift ."], label: "Ten frames forward", run: () => navigation.step(10) },
    { keys: ["Home"], label: "First frame", run: () => navigation.first() },
    { keys: ["End"], label: "Last frame", run: () => navigation.last() },
    { keys: ["Space"], label: "Play or pause", run: () => playback.toggle() },
  ]);
}

/**
 * @param {Store} store
 * @param {Actions} actions
 * @param {Reasons} reasons
 */
export function trackBindings(store, actions, reasons) {
  const track = (/** @type {"forward" | "backward"} */ way) => () => {
    if (store.facts.connected && !store.facts.state?.track.running) actions.track(way);
  };
  const { track: why, tracking } = reasons;
  return inArea("Tracking", [
    { keys: ["T"], label: "Track forward", why, run: track("forward") },
    { keys: ["Shift T"], label: "Track backward", why, run: track("backward") },
    { label: "Pause or continue tracking", why: tracking, run: () => actions.togglePause() },
    { label: "Follow the tracker (toggle)", why: tracking, run: () => actions.toggleFollow() },
  ]);
}

/** @param {import("./drawer.js").Drawer} drawer */
export function drawerBindings(drawer) {
  return inArea("Views", [
    { keys: ["C"], label: "Curves", run: () => drawer.toggleCurves() },
    { label: "Search panel", run: () => drawer.toggle("search") },
    { label: "Cost landscape", run: () => drawer.toggle("landscape") },
    { label: "Doubtful and lost poses, most severe first", run: () => drawer.toggle("doubts") },
    { label: "Poses compared with those that they replaced", run: () => drawer.toggle("runs") },
  ]);
}

/** @param {import("../posing/curve_edits.js").CurveEdits} edits */
export function curveBindings(edits) {
  const { why } = edits;
  const whyNone = () => (edits.choices().length > 0 ? null : "No curve can be edited here. Open the curves, and choose Arms, Torso or Legs.");
  return inArea("Posing", [
    { label: "Curves: choose the next curve (U in the curves)", why: whyNone, run: () => edits.next(false) },
    { label: "Curves: choose one more curve (Shift+U in the curves)", why: whyNone, run: () => edits.next(true) },
    { label: "Curves: raise the chosen values by one step (↑ in the curves)", why, run: () => edits.step(1) },
    { label: "Curves: lower the chosen values by one step (↓ in the curves)", why, run: () => edits.step(-1) },
  ]);
}

/**
 * @param {import("./doubt_queue.js").DoubtQueue} queue
 * @param {() => string | null} away
 */
export function queueBindings(queue, away) {
  const why = () => away() ?? queue.why();
  return inArea("Timeline", [
    { label: "Next doubtful or lost pose by severity", why, run: () => queue.step(1) },
    { label: "Previous doubtful or lost pose by severity", why, run: () => queue.step(-1) },
    command("Accept the doubtful or lost poses here: mark them as reviewed", "", () => queue.accept(queue.current()), () =>
      away() ?? queue.whyNotAccept(),
    ),
  ]);
}

/**
 * @param {{store: Store, actions: Actions, playback: Playback, jumps: import("./jumps.js").Jumps,
 *   frameWindow: import("./frame_window.js").FrameWindow, reasons: Reasons}} parts
 */
export function timelineBindings({ store, actions, playback, jumps, frameWindow, reasons }) {
  return inArea("Timeline", [
    { label: "Loop playback, within the marked range if there is one (toggle)", run: () => playback.toggleLoop() },
    { label: "Play slower", run: () => playback.changeRate(-1) },
    { label: "Play faster", run: () => playback.changeRate(1) },
    ...KINDS.flatMap(({ kind, keys, more }) => jumpKeys(jumps, kind, more, keys)),
    { label: "Middle of the longest gap", words: "between keyframes", run: () => jumps.toLongestGap() },
    ...markBindings(store, actions, reasons),
    { label: "Timeline: zoom in", run: () => frameWindow.zoomIn() },
    { label: "Timeline: zoom out", run: () => frameWindow.zoomOut() },
    { label: "Timeline: show the marked range, or all frames", run: () => frameWindow.fit() },
    ...rangeBindings(store),
  ]);
}

/**
 * @param {Store} store
 * @param {Actions} actions
 * @param {Reasons} reasons
 * @returns {Command[]}
 */
function markBindings(store, actions, reasons) {
  const interpolate = () => {
    if (store.facts.connected && store.facts.range) actions.onRange("interpolate", null);
  };
  return [
    { keys: ["K"], label: "Keyframe: confirm this pose (toggle)", run: () => actions.toggleMark("keyframe") },
    { label: "Remove the marks of this frame", run: () => actions.unmark() },
    { keys: ["E"], label: "Reviewed (toggle)", run: () => actions.toggleMark("reviewed") },
    { label: "Interpolate the marked range", why: reasons.range, run: interpolate },
    command("Estimate the poses here again", "marked range, or the poses around this frame", () => actions.estimateAgain(), reasons.away),
  ];
}

/**
 * @param {Store} store
 * @returns {Command[]}
 */
function rangeBindings(store) {
  const mark = (/** @type {"first" | "last"} */ end) => () => {
    const { range, target } = store.facts;
    const other = end === "first" ? (range?.last ?? target) : (range?.first ?? target);
    store.set({ range: { first: Math.min(target, other), last: Math.max(target, other) } });
  };
  return [
    { keys: ["["], label: "Mark the start of a range", run: mark("first") },
    { keys: ["]"], label: "Mark the end of a range", run: mark("last") },
  ];
}

/**
 * @param {import("./jumps.js").Jumps} jumps
 * @param {import("./jumps.js").Kind} kind
 * @param {string} what
 * @param {[string[], string[]]} [keys] to the next and to the previous one
 * @returns {Command[]}
 */
function jumpKeys(jumps, kind, what, keys = [[], []]) {
  const why = () => (jumps.count(kind) > 0 ? null : `There is no ${what}.`);
  return [
    { keys: keys[0], label: `Next ${what}`, why, run: () => jumps.go(kind, 1) },
    { keys: keys[1], label: `Previous ${what}`, why, run: () => jumps.go(kind, -1) },
  ];
}
