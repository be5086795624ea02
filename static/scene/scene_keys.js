/** Keys of the 3-D view and of the floor. */

import { inArea, matchesKey } from "../widgets/key_matching.js";

/**
 * @param {import("./camera_view.js").CameraView} cameraView
 * @param {import("./floor.js").Floor} floor
 * @param {() => string | null} away why the 3-D view is unavailable
 */
export function sceneBindings(cameraView, floor, away) {
  const why = () => (floor.isOn ? null : "The floor is not being set. Press Shift+Y to start.");
  /** @type {import("../widgets/key_matching.js").Command[]} */
  const bindings = [
    { keys: ["Y"], label: "3-D view: look through the active camera (toggle)", run: () => cameraView.toggle() },
    { keys: ["Shift Y"], label: "Set the floor from three clicked points (toggle)", run: () => floor.toggle() },
    {
      keys: ["Enter"],
      label: "Setting the floor: next point, then apply",
      matches: (event) => floor.isOn && matchesKey("Enter")(event),
      why,
      run: () => floor.goOn(),
    },
    {
      keys: ["Backspace"],
      label: "Setting the floor: undo the last click",
      matches: (event) => floor.isOn && matchesKey("Backspace")(event),
      why,
      run: () => floor.takeBack(),
    },
  ];
  return inArea("3-D view", bindings, away);
}
