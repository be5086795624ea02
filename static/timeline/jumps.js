/** Frames to go to, by kind: their number, and the next one in either direction. */

import { AMBIGUOUS, KEYFRAME, NO_POSE, REVIEWED, STATUSES, keyframesOf } from "../model/cells.js";
import { filterTest } from "../model/provenance.js";
import { copyDifferences, earlierCalibration } from "../model/selectors.js";

/** @typedef {"doubt" | "ambiguous" | "unreviewed" | "disagreeing" | "earlier" | "copy" | "chosen" | "keyframe" | "empty"} Kind */

/** @type {{kind: Kind, label: string, title: string, more: string, keys?: [string[], string[]]}[]} */
export const KINDS = [
  {
    kind: "doubt", label: "Doubtful or lost", keys: [["N"], ["Shift N"]], more: "doubtful or lost frame",
    title: "Frames whose pose the tracker is not sure of, and that nobody has confirmed or reviewed",
  },
  {
    kind: "ambiguous", label: "Ambiguous", more: "ambiguous frame",
    title: "Frames where another pose, drawn dashed, fits about as well. Use it, or keep the current pose as a keyframe",
  },
  { kind: "unreviewed", label: "Not reviewed", title: "Frames whose pose nobody has confirmed or reviewed", more: "unreviewed frame" },
  {
    kind: "disagreeing", label: "Inconsistent", more: "frame inconsistent with its neighbours",
    title: "Frames where the body jumps, for example between two runs or next to a keyframe",
  },
  {
    kind: "earlier", label: "Earlier calibration", more: "frame of an earlier calibration",
    title: "Frames with a pose that was made before the cameras were corrected",
  },
  {
    kind: "copy", label: "Other copy differs", more: "frame where the copies differ",
    title: "Frames on which the copy that the inspector compares differs by more than the tolerance, and nobody has decided",
  },
  {
    kind: "chosen", label: "Filtered by provenance", more: "frame of the chosen provenance",
    title: "Frames that the filter of the inspector's section Provenance lets through",
  },
  { kind: "keyframe", label: "Keyframes", title: "Frames whose pose a person has set or confirmed", more: "keyframe" },
  { kind: "empty", label: "Without a pose", title: "Frames that have no pose", more: "frame without a pose" },
]; // prettier-ignore

const DOUBT = STATUSES.indexOf("doubtful");

/** @typedef {ReturnType<typeof makeJumps>} Jumps */

/**
 * @param {import("../model/store.js").Store} store
 * @param {import("../model/navigation.js").Navigation} navigation
 * @param {(frame: number) => void} arriveAtDoubt called with a doubtful frame after it was requested
 */
export function makeJumps(store, navigation, arriveAtDoubt) {
  /** @param {Kind} kind */
  function count(kind) {
    const { facts } = store;
    const { timeline } = facts;
    if (kind === "empty") return timeline.frames - timeline.size;
    const is = tests(facts)[kind];
    let count = 0;
    for (let frame = 0; frame < timeline.frames; frame += 1) if (is(frame)) count += 1;
    return count;
  }

  /**
   * Go to the nearest frame of a kind in one direction, if there is one.
   *
   * @param {Kind} kind
   * @param {1 | -1} way
   */
  function go(kind, way) {
    const { facts } = store;
    const { timeline, target } = facts;
    const is = tests(facts)[kind];
    navigation.pause();
    for (let frame = target + way; frame >= 0 && frame < timeline.frames; frame += way) {
      if (!is(frame)) continue;
      navigation.goTo(frame);
      if (kind === "doubt") arriveAtDoubt(frame);
      return;
    }
  }

  /** The longest gap between keyframes; null if there is none. */
  function longestGap() {
    const { timeline } = store.facts;
    let [first, last] = [0, -1];
    let previous = -1;
    for (const frame of [...keyframesOf(timeline), timeline.frames]) {
      if (frame - previous - 2 > last - first) [first, last] = [previous + 1, frame - 1];
      previous = frame;
    }
    return last >= first ? { first, last } : null;
  }

  /** Go to the middle of the longest gap between keyframes, the best place for a new one. */
  function toLongestGap() {
    const gap = longestGap();
    navigation.pause();
    if (gap) navigation.goTo(Math.floor((gap.first + gap.last) / 2));
  }

  /**
   * The interval between the keyframes around a frame, both included, or the ends of the recording.
   *
   * @param {number} frame
   */
  function intervalAround(frame) {
    const { timeline } = store.facts;
    const isKey = (/** @type {number} */ at) => (timeline.marks[at] & KEYFRAME) !== 0;
    let [first, last] = [frame, frame];
    while (first > 0 && !(first < frame && isKey(first))) first -= 1;
    while (last < timeline.frames - 1 && !(last > frame && isKey(last))) last += 1;
    // On a keyframe, use the interval that starts there.
    return { first: isKey(frame) && last > frame ? frame : first, last };
  }

  return { count, go, longestGap, toLongestGap, intervalAround };
}

/**
 * @param {import("../model/store.js").Facts} facts
 * @returns {Record<Kind, (frame: number) => boolean>}
 */
function tests(facts) {
  const { sources, statuses, marks } = facts.timeline;
  const disagreeing = new Set(facts.disagreeing);
  const earlier = earlierCalibration(facts);
  const apart = new Set(copyDifferences(facts).map(({ frame }) => frame));
  // Of several people, a frame counts on which somebody's pose is of the kind.
  const chosen = (facts.lanes.length ? [...facts.lanes.keys()] : [null]).map((person) => filterTest(facts, person));
  return {
    copy: (frame) => apart.has(frame),
    chosen: (frame) => chosen.some((is) => is?.(frame)),
    disagreeing: (frame) => disagreeing.has(frame),
    earlier: (frame) => earlier.some((own) => own.has(frame)),
    doubt: (frame) => statuses[frame] >= DOUBT && !(marks[frame] & REVIEWED),
    ambiguous: (frame) => (marks[frame] & AMBIGUOUS) !== 0,
    unreviewed: (frame) => sources[frame] !== NO_POSE && !(marks[frame] & REVIEWED),
    keyframe: (frame) => (marks[frame] & KEYFRAME) !== 0,
    empty: (frame) => sources[frame] === NO_POSE,
  };
}
