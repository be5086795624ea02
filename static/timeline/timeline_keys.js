/** The keys of timeline, playback and ranges; `keys.js` takes them into its table. */

import { KINDS } from "./jumps.js";
import { alt, plain } from "../widgets/key_matching.js";
import { unavailableReasons } from "../model/unavailable_reasons.js";

/**
 * @param {{store: import("../model/store.js").Store, actions: import("../model/actions.js").Actions,
 *   playback: import("./playback.js").Playback, jumps: import("./jumps.js").Jumps,
 *   frameWindow: import("./frame_window.js").FrameWindow}} parts
 * @returns {import("../widgets/key_matching.js").Binding[]}
 */
export function timelineBindings({ store, actions, playback, jumps, frameWindow }) {
  const interpolate = () => {
    if (store.facts.connected && store.facts.range) actions.onRange("interpolate", null);
  };
  return [
    {
      keys: ["Shift Space"],
      label: "Play in a loop, of the marked range where there is one, or not",
      matches: plain(" ", undefined, true),
      run: () => playback.toggleLoop(),
    },
    { keys: [";"], label: "Play slower", matches: plain(";", "Semicolon"), run: () => playback.changeRate(-1) },
    { keys: ["'"], label: "Play faster", matches: plain("'", "Quote"), run: () => playback.changeRate(1) },
    ...KINDS.filter(({ key }) => key).flatMap(({ kind, key, more }) => jumpKeys(jumps, kind, key, more)),
    {
      keys: ["Q"],
      label: "Middle of the longest stretch without a keyframe",
      matches: plain("q"),
      run: () => jumps.toLongestGap(),
    },
    {
      keys: ["K"],
      label: "Keyframe: vouch for this pose, or take that back",
      matches: plain("k"),
      run: () => actions.toggleMark("keyframe"),
    },
    {
      keys: ["Shift K"],
      label: "Take the marks of this frame away",
      matches: plain("k", undefined, true),
      run: () => actions.unmark(),
    },
    { keys: ["E"], label: "Reviewed, or not", matches: plain("e"), run: () => actions.toggleMark("reviewed") },
    {
      keys: ["Shift I"],
      label: "Interpolate the marked range",
      matches: plain("i", undefined, true),
      why: unavailableReasons(store).range,
      run: interpolate,
    },
    { keys: ["Z"], label: "Timeline: see fewer frames", matches: plain("z"), run: () => frameWindow.zoomIn() },
    {
      keys: ["Shift Z"],
      label: "Timeline: see more frames",
      matches: plain("z", undefined, true),
      run: () => frameWindow.zoomOut(),
    },
    {
      keys: ["Alt Z"],
      label: "Timeline: the marked range, or all frames",
      matches: alt("KeyZ", false),
      run: () => frameWindow.fit(),
    },
  ];
}

/**
 * @param {import("./jumps.js").Jumps} jumps
 * @param {import("./jumps.js").Kind} kind
 * @param {string} key
 * @param {string} what
 * @returns {import("../widgets/key_matching.js").Binding[]}
 */
function jumpKeys(jumps, kind, key, what) {
  const letter = key.slice(-1);
  const why = () => (jumps.count(kind) > 0 ? null : `There is no ${what}.`);
  const match = (/** @type {boolean} */ shift) =>
    key.startsWith("Alt ") ? alt(`Key${letter}`, shift) : plain(letter.toLowerCase(), undefined, shift);
  const former = key.startsWith("Alt ") ? `Alt Shift ${letter}` : `Shift ${letter}`;
  return [
    { keys: [key], label: `Next ${what}`, matches: match(false), why, run: () => jumps.go(kind, 1) },
    { keys: [former], label: `Former ${what}`, matches: match(true), why, run: () => jumps.go(kind, -1) },
  ];
}
