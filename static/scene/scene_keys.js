/** Keys of the 3-D view and of the floor. */

import { inArea } from "../widgets/key_matching.js";

/**
 * @param {import("./camera_view.js").CameraView} cameraView
 * @param {import("./floor.js").Floor} floor
 * @param {() => string | null} away why the 3-D view is unavailable
 */
export function sceneBindings(cameraView, floor, away) {
  const why = () => (floor.isOn() ? null : "The floor is not being set. Set floor… in the inspector starts that.");
  /** @type {import("../widgets/key_matching.js").Command[]} */
  const bindings = [
    { label: "3-D view: look through the active camera (toggle)", run: () => cameraView.toggle() },
    { label: "Set the floor from three clicked points (toggle)", run: () => floor.toggle() },
    { label: "Setting the floor: next point, then apply", matches: ({ key }) => floor.isOn() && key === "Enter", why, run: () => floor.goOn() },
    { label: "Setting the floor: undo the last click", matches: ({ key }) => floor.isOn() && key === "Backspace", why, run: () => floor.takeBack() },
  ];
  return inArea("3-D view", bindings, away);
}
