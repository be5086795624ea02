/** Keys that edit poses and pins. */

import { alt, inArea, plain } from "../widgets/key_matching.js";

/** @type {[string, string, import("./posing.js").Way][]} */
const WAYS = [
  ["←", "left", { right: -1, up: 0 }],
  ["→", "right", { right: 1, up: 0 }],
  ["↑", "up", { right: 0, up: 1 }],
  ["↓", "down", { right: 0, up: -1 }],
];

/**
 * @param {import("./posing.js").Posing} posing
 * @param {import("./joint_bar.js").JointBar} jointBar
 * @param {() => string | null} why why posing is unavailable
 */
export function posingBindings(posing, jointBar, why) {
  const sign = (/** @type {string[]} */ keys) => (/** @type {KeyboardEvent} */ event) =>
    keys.includes(event.key) && !event.ctrlKey && !event.metaKey && !event.altKey;
  const bindings = [
    { keys: ["J"], label: "Next joint", matches: plain("j"), run: () => posing.toJoint(1) },
    { keys: ["Shift J"], label: "Previous joint", matches: plain("j", undefined, true), run: () => posing.toJoint(-1) },
    ...WAYS.map(([arrow, name, way]) => ({
      keys: [arrow],
      label: `Move the joint or body one step ${name} in the active view (Shift: ×10, Ctrl: ×0.1)`,
      matches: (/** @type {KeyboardEvent} */ event) =>
        event.key === `Arrow${name[0].toUpperCase()}${name.slice(1)}` && !event.altKey && !event.metaKey,
      run: (/** @type {KeyboardEvent} */ event) => posing.nudge(way, event.shiftKey ? 10 : event.ctrlKey ? 0.1 : 1),
    })),
    { keys: ["U"], label: "Next degree of freedom", matches: plain("u"), run: () => posing.nextDof() },
    { keys: ["+"], label: "Increase the selected degree of freedom by one step", matches: sign(["+", "="]), run: () => posing.turn(1) },
    { keys: ["-"], label: "Decrease the selected degree of freedom by one step", matches: sign(["-", "_"]), run: () => posing.turn(-1) },
    { keys: ["Enter"], label: "Type a value for the selected degree of freedom", matches: plain("enter"), run: () => jointBar.type() },
    { keys: ["O"], label: "Lock or unlock the joint", matches: plain("o"), run: () => posing.toggleLock(posing.dofs) },
    {
      keys: ["Shift O"],
      label: "Lock or unlock the joint's limb",
      matches: plain("o", undefined, true),
      run: () => posing.toggleLock(posing.limb.dofs),
    },
    {
      keys: ["Alt H"],
      label: "Hold the joint in place while others are dragged, or release it",
      matches: alt("KeyH", false),
      run: () => posing.toggleHold(),
    },
    {
      keys: ["Alt Shift H"],
      label: "Release all held joints of the person on this frame",
      matches: alt("KeyH", true),
      run: () => posing.releaseAll(),
    },
    { keys: ["M"], label: "Mirror the pose left to right", matches: plain("m"), run: () => posing.mirror() },
    {
      keys: ["Shift X"],
      label: "Switch to the alternative pose, or back",
      matches: plain("x", undefined, true),
      run: () => posing.takeAlternative(),
    },
    {
      keys: ["Alt 1 – 9"],
      label: "Take an alternative pose by its number in the views",
      matches: (/** @type {KeyboardEvent} */ event) => /^Digit[1-9]$/.test(event.code) && alt(event.code, false)(event),
      why: () => why() ?? posing.whyNoRanked,
      run: (/** @type {KeyboardEvent} */ event) => posing.takeAlternative(Number(event.code.at(-1)) - 1),
    },
    { keys: ["R"], label: "Reset the joint's limb to neutral", matches: plain("r"), run: () => posing.resetLimb() },
    { keys: ["Alt ,"], label: "Copy the pose from the previous frame", matches: alt("Comma", false), run: () => posing.copyNeighbour(-1) },
    { keys: ["Alt ."], label: "Copy the pose from the next frame", matches: alt("Period", false), run: () => posing.copyNeighbour(1) },
  ];
  return inArea("Posing", bindings, why);
}

/**
 * @param {import("./pinning.js").Pinning} pinning
 * @param {() => string | null} why why pins are unavailable
 */
export function pinBindings(pinning, why) {
  const shift = (/** @type {string} */ key) => plain(key, undefined, true);
  const bindings = [
    { keys: ["X"], label: "Pin the joint by clicks (toggle)", matches: plain("x"), run: () => pinning.toggle() },
    { keys: ["G"], label: "Fit to pins and edges", matches: plain("g"), run: () => pinning.fit() },
    {
      keys: ["Alt G"],
      label: "Fit only the limb of the selected joint",
      words: "arm leg part",
      matches: alt("KeyG", false),
      run: () => pinning.fitLimb(),
    },
    {
      keys: ["Alt B"],
      label: "Take back the untouched limb that the last fit moved",
      matches: alt("KeyB", false),
      run: () => pinning.takeLimbBack(),
    },
    {
      keys: ["Shift G"],
      label: "Update the body while a pin is dragged (toggle)",
      matches: shift("g"),
      run: () => pinning.toggleLive(),
    },
    {
      keys: ["Delete"],
      label: "Remove the pin under the pointer, or else those of the selected joint",
      matches: plain("delete"),
      run: () => pinning.remove(),
    },
    {
      keys: ["Shift Delete"],
      label: "Remove all pins of the person on this frame",
      matches: shift("delete"),
      run: () => pinning.clear(),
    },
  ];
  return inArea("Pins", bindings, why);
}

/**
 * @param {import("./pose_notes.js").PoseNotes} notes
 * @param {() => string | null} away
 */
export function noteBindings(notes, away) {
  return inArea("Posing", [
    {
      keys: ["Alt V"],
      label: "Fill the grid with the view that looks across the last placed joint",
      words: "depth opposite side",
      matches: alt("KeyV", false),
      why: () => away() ?? notes.whyNotAcross,
      run: () => notes.showAcross(),
    },
  ]);
}

/**
 * @param {import("./epipolar_check.js").EpipolarCheck} check
 * @param {() => string | null} why
 */
export function epipolarBindings(check, why) {
  const binding = {
    keys: ["Alt X"],
    label: "Epipolar lines (toggle)",
    words: "calibration check cameras line of sight distance pointer",
    matches: alt("KeyX", false),
    run: () => check.toggle(),
  };
  return inArea("Views", [binding], why);
}
