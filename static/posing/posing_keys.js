/** Keys that edit poses and pins. */

import { command, inArea } from "../widgets/key_matching.js";
import { factorOf } from "../widgets/number_field.js";

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
    { keys: ["J"], label: "Next joint", run: () => posing.toJoint(1) },
    { keys: ["Shift J"], label: "Previous joint", run: () => posing.toJoint(-1) },
    ...WAYS.map(([arrow, name, way]) => ({
      keys: [arrow],
      label: `Move the joint or body one step ${name} in the active view (Shift: ×10, Ctrl: ×0.1)`,
      matches: (/** @type {KeyboardEvent} */ event) =>
        event.key === `Arrow${name[0].toUpperCase()}${name.slice(1)}` && !event.altKey && !event.metaKey,
      run: (/** @type {KeyboardEvent} */ event) => posing.nudge(way, factorOf(event)),
    })),
    { keys: ["U"], label: "Next degree of freedom", run: () => posing.nextDof() },
    { keys: ["+"], label: "Increase the selected degree of freedom by one step", matches: sign(["+", "="]), run: () => posing.turn(1) },
    { keys: ["-"], label: "Decrease the selected degree of freedom by one step", matches: sign(["-", "_"]), run: () => posing.turn(-1) },
    { label: "Type a value for the selected degree of freedom", run: () => jointBar.type() },
    { keys: ["O"], label: "Lock or unlock the joint", run: () => posing.toggleLock(posing.joint().dofs) },
    { label: "Lock or unlock the joint's limb", run: () => posing.toggleLock(posing.joint().limb.dofs) },
    { label: "Hold the joint in place while others are dragged, or release it", run: () => posing.toggleHold() },
    { label: "Release all held joints of the person on this frame", run: () => posing.releaseAll() },
    { label: "Mirror the pose left to right", run: () => posing.mirror() },
    { label: "Switch to the alternative pose, or back", run: () => posing.takeAlternative() },
    { label: "Reset the joint's limb to neutral", run: () => posing.resetLimb() },
    { label: "Copy the pose from the previous frame", run: () => posing.copyNeighbour(-1) },
    { label: "Copy the pose from the next frame", run: () => posing.copyNeighbour(1) },
  ];
  return inArea("Posing", bindings, why);
}

/**
 * @param {import("./pinning.js").Pinning} pinning
 * @param {() => string | null} why why pins are unavailable
 */
export function pinBindings(pinning, why) {
  const bindings = [
    { keys: ["X"], label: "Pin the joint by clicks (toggle)", run: () => pinning.toggle() },
    { keys: ["G"], label: "Fit to pins and edges", run: () => pinning.fit() },
    { label: "Fit only the limb of the selected joint", words: "arm leg part", run: () => pinning.fitLimb() },
    { label: "Take back the untouched limb that the last fit moved", run: () => pinning.takeLimbBack() },
    { label: "Update the body while a pin is dragged (toggle)", run: () => pinning.toggleLive() },
    { keys: ["Delete"], label: "Remove the pin under the pointer, or else those of the selected joint", run: () => pinning.remove() },
    { label: "Remove all pins of the person on this frame", run: () => pinning.clear() },
  ];
  return inArea("Pins", bindings, why);
}

/**
 * @param {import("../model/store.js").Store} store
 * @param {import("../panes/pane_grid.js").PaneGrid} grid
 * @param {() => string | null} away
 */
export function depthBindings({ facts }, grid, away) {
  const across = () => facts.state?.view_across ?? null;
  const why = () => away() ?? (across() === null ? "The views have shown the depth of the last placed joint." : null);
  const run = () => {
    const camera = across();
    if (camera !== null && camera !== facts.filled) grid.toggleFill(camera);
  };
  const label = "Fill the grid with the view that looks across the last placed joint";
  return inArea("Posing", [command(label, "depth opposite side", run, why)]);
}

/**
 * @param {import("./epipolar_check.js").EpipolarCheck} check
 * @param {() => string | null} why
 */
export function epipolarBindings(check, why) {
  const words = "calibration check cameras line of sight distance pointer";
  return inArea("Views", [command("Epipolar lines (toggle)", words, check.toggle, why)]);
}
