/** Keys of navigation, tracking, timeline and drawer. */

import { inArea } from "../widgets/key_matching.js";
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
    { keys: ["Alt P"], label: "Pause or continue tracking", why: tracking, run: () => actions.togglePause() },
    { keys: ["L"], label: "Follow the tracker (toggle)", why: tracking, run: () => actions.toggleFollow() },
  ]);
}

/** @param {import("./drawer.js").Drawer} drawer */
export function drawerBindings(drawer) {
  return inArea("Views", [
    { keys: ["C"], label: "Curves", run: () => drawer.toggleCurves() },
    { keys: ["B"], label: "Search panel", run: () => drawer.toggle("search") },
    { keys: ["V"], label: "Cost landscape", run: () => drawer.toggle("landscape") },
    { keys: ["Shift L"], label: "Doubtful and lost poses, most severe first", run: () => drawer.toggle("doubts") },
    { keys: [], label: "Poses compared with those that they replaced", run: () => drawer.toggle("runs") },
  ]);
}

/** @param {import("../posing/curve_edits.js").CurveEdits} edits */
export function curveBindings(edits) {
  const { why } = edits;
  const whyNone = () => (edits.choices.length > 0 ? null : "No curve can be edited here. Press C, and choose Arms, Torso or Legs.");
  return inArea("Posing", [
    { keys: [], label: "Curves: choose the next curve (U in the curves)", why: whyNone, run: () => edits.next(false) },
    { keys: [], label: "Curves: choose one more curve (Shift+U in the curves)", why: whyNone, run: () => edits.next(true) },
    { keys: [], label: "Curves: raise the chosen values by one step (↑ in the curves)", why, run: () => edits.step(1) },
    { keys: [], label: "Curves: lower the chosen values by one step (↓ in the curves)", why, run: () => edits.step(-1) },
  ]);
}

/**
 * @param {import("./doubt_queue.js").DoubtQueue} queue
 * @param {() => string | null} away
 */
export function queueBindings(queue, away) {
  const why = () => away() ?? queue.why;
  return inArea("Timeline", [
    { keys: ["Alt ↓"], label: "Next doubtful or lost pose by severity", why, run: () => queue.step(1) },
    { keys: ["Alt ↑"], label: "Previous doubtful or lost pose by severity", why, run: () => queue.step(-1) },
    {
      keys: ["Alt Enter"],
      label: "Accept the doubtful or lost poses here: mark them as reviewed",
      why: () => away() ?? queue.whyNotAccept,
      run: () => queue.accept(queue.current),
    },
  ]);
}

/**
 * @param {{store: Store, actions: Actions, playback: Playback, jumps: import("./jumps.js").Jumps,
 *   frameWindow: import("./frame_window.js").FrameWindow, reasons: Reasons}} parts
 */
export function timelineBindings({ store, actions, playback, jumps, frameWindow, reasons }) {
  return inArea("Timeline", [
    ...playBindings(playback),
    ...KINDS.filter(({ key }) => key).flatMap(({ kind, key, more }) => jumpKeys(jumps, kind, key, more)),
    { keys: ["Q"], label: "Middle of the longest gap", words: "between keyframes", run: () => jumps.toLongestGap() },
    ...markBindings(store, actions, reasons),
    { keys: ["Z"], label: "Timeline: zoom in", run: () => frameWindow.zoomIn() },
    { keys: ["Shift Z"], label: "Timeline: zoom out", run: () => frameWindow.zoomOut() },
    { keys: ["Alt Z"], label: "Timeline: show the marked range, or all frames", run: () => frameWindow.fit() },
    ...rangeBindings(store),
  ]);
}

/**
 * @param {Playback} playback
 * @returns {Command[]}
 */
function playBindings(playback) {
  return [
    { keys: ["Shift Space"], label: "Loop playback, within the marked range if there is one (toggle)", run: () => playback.toggleLoop() },
    { keys: [";"], label: "Play slower", run: () => playback.changeRate(-1) },
    { keys: ["'"], label: "Play faster", run: () => playback.changeRate(1) },
  ];
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
    { keys: ["Shift K"], label: "Remove the marks of this frame", run: () => actions.unmark() },
    { keys: ["E"], label: "Reviewed (toggle)", run: () => actions.toggleMark("reviewed") },
    { keys: ["Shift I"], label: "Interpolate the marked range", why: reasons.range, run: interpolate },
    {
      keys: ["Shift R"],
      label: "Estimate the poses here again",
      words: "marked range, or the poses around this frame",
      why: reasons.away,
      run: () => actions.estimateAgain(),
    },
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
 * @param {string} key
 * @param {string} what
 * @returns {import("../widgets/key_matching.js").Command[]}
 */
function jumpKeys(jumps, kind, key, what) {
  const letter = key.slice(-1);
  const why = () => (jumps.count(kind) > 0 ? null : `There is no ${what}.`);
  const previous = key.startsWith("Alt ") ? `Alt Shift ${letter}` : `Shift ${letter}`;
  return [
    { keys: [key], label: `Next ${what}`, why, run: () => jumps.go(kind, 1) },
    { keys: [previous], label: `Previous ${what}`, why, run: () => jumps.go(kind, -1) },
  ];
}
