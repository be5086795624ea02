/** Settings of the tracker. */

import { checkRow, choiceRow, numberRow, textButton } from "./rows.js";

/** @typedef {import("../model/protocol.js").TrackValues} TrackValues */

/** @type {Record<"0" | "1" | "2", string>} by degree of the motion model */
const ORDERS = { 0: "Stays in place", 1: "Constant velocity", 2: "Constant acceleration" };

/**
 * @param {import("../model/index.js").Context} context
 * @returns {import("./inspector.js").Section}
 */
export function trackSection({ store, send, notify }) {
  const set = (/** @type {Partial<TrackValues>} */ changes) => send({ type: "track_settings", changes });
  const refuse = (/** @type {string} */ text) => notify({ type: "notice", level: "info", text });
  const method = choiceRow({
    label: "Method",
    title: "Chamfer matching searches whole bodies where refinement fails. Extremal contours (KRH08) refine until they converge. Voxels (MTHC01) are carved from the silhouettes and filtered over time",
    options: [
      ["chamfer", "Chamfer matching"],
      ["contour", "Extremal contours"],
      ["voxel", "Voxels"],
    ],
    change: (value) => set({ method: value }),
  });
  const stride = numberRow({
    label: "Stride",
    title: "Track every Nth frame alone. The frames between get no pose, and can be interpolated",
    low: 1,
    high: 100,
    step: 1,
    change: (value) => set({ stride: Math.round(value ?? 1) }),
    refuse,
  });
  const cameras = cameraChoices((names) => set({ cameras: names }), refuse);
  const estimate = choiceRow({
    label: "Estimation",
    title: "How the pose of a frame is found from its prediction. Refinement fits contours to edges and searches only what it cannot fit",
    options: [
      ["refine", "Refine, then search"],
      ["search", "Search only (GD96)"],
    ],
    change: (value) => set({ estimate: value }),
  });
  const order = choiceRow({
    label: "Prediction",
    title: "Motion model that predicts the pose of the next frame. GD96 uses constant acceleration, which overshoots on noisy poses",
    options: [
      ["0", ORDERS[0]],
      ["1", ORDERS[1]],
      ["2", ORDERS[2]],
    ],
    change: (value) => set({ order: Number(value) }),
  });
  const past = numberRow({
    label: "Past poses",
    title: "Number of poses from which the motion is predicted, 1 to 8",
    low: 1,
    high: 8,
    step: 1,
    change: (value) => set({ past_poses: Math.round(value ?? 1) }),
    refuse,
  });
  const recover = checkRow({
    label: "Search lost limbs",
    title: "Search for a limb that is not where edges and colours are",
    change: (on) => set({ recover: on }),
  });
  const backward = checkRow({
    label: "Backward pass",
    title: "At the end of a run, track lost people backward from the frame where they were found again",
    change: (on) => set({ backward_pass: on }),
  });
  const smooth = checkRow({
    label: "Smooth",
    title: "At the end of a run, smooth the poses over time. Keyframes stay, lost limbs are not trusted",
    change: (on) => set({ smooth: on }),
  });
  const reset = textButton("Reset", "Restore the default track settings", () => {
    const { settings } = store.facts;
    if (settings) set(settings.track_default);
  });
  const body = document.createElement("div");
  body.append(method.element, stride.element, cameras.element, estimate.element, order.element, past.element, recover.element, backward.element, smooth.element, reset);

  const show = () => {
    const { settings } = store.facts;
    if (!settings) return;
    const { track, track_default: initial } = settings;
    method.show(track.method, track.method !== initial.method);
    stride.show(track.stride, track.stride !== initial.stride);
    cameras.show(store.facts.session?.cameras.map((camera) => camera.name) ?? [], track.cameras);
    estimate.element.hidden = track.method !== "chamfer";
    for (const row of [order, past, recover, backward]) row.element.hidden = track.method === "voxel";
    estimate.show(track.estimate, track.estimate !== initial.estimate);
    order.show(/** @type {"0"} */ (String(track.order)), track.order !== initial.order);
    past.show(track.past_poses, track.past_poses !== initial.past_poses);
    recover.show(track.recover, track.recover !== initial.recover);
    backward.show(track.backward_pass, track.backward_pass !== initial.backward_pass);
    smooth.show(track.smooth, track.smooth !== initial.smooth);
    reset.disabled = JSON.stringify(track) === JSON.stringify(initial);
  };
  return {
    id: "track",
    title: "Track settings",
    hint: "How the tracker (T) finds the pose of each frame",
    body,
    update: (changed) => (changed.has("settings") || changed.has("session")) && show(),
  };
}

/**
 * A box for each camera: the cameras to track with.
 *
 * @param {(names: string[]) => void} change receives the checked cameras; none for all
 * @param {(text: string) => void} refuse
 */
function cameraChoices(change, refuse) {
  const element = document.createElement("div");
  element.title = "Cameras to track with. The others are still shown";
  element.setAttribute("role", "group");
  element.setAttribute("aria-label", "Cameras to track with");
  const head = document.createElement("span");
  head.className = "row-label";
  head.textContent = "Cameras";
  const list = document.createElement("div");
  list.className = "camera-choices";
  element.append(head, list);
  const boxes = () => [...list.querySelectorAll("input")];
  let built = "";
  list.addEventListener("change", (event) => {
    const chosen = boxes().filter((box) => box.checked);
    if (chosen.length === 0 && event.target instanceof HTMLInputElement) {
      event.target.checked = true;
      refuse("Cameras: expected at least one to track with. Check another one first.");
      return;
    }
    change(chosen.length === boxes().length ? [] : chosen.map((box) => box.value));
  });
  return {
    element,
    /**
     * @param {string[]} names of all cameras
     * @param {string[]} chosen none for all
     */
    show(names, chosen) {
      if (built !== names.join("\n")) {
        built = names.join("\n");
        list.replaceChildren(...names.map(cameraBox));
      }
      for (const box of boxes()) box.checked = chosen.length === 0 || chosen.includes(box.value);
      head.classList.toggle("is-changed", chosen.length > 0);
    },
  };
}

/** @param {string} name */
function cameraBox(name) {
  const label = document.createElement("label");
  const box = document.createElement("input");
  Object.assign(box, { type: "checkbox", value: name });
  label.append(box, name);
  return label;
}
