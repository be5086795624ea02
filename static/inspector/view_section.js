/** Theme of the page, error ellipses, and what the 3-D view shows: layers, the camera to look through, the floor and trails. */

import { checkbox, make, textButton } from "../widgets/elements.js";
import { displayName } from "../widgets/text.js";
import { NO_OPTIONS, checkRow, choiceRow, sectionNote, sliderRow } from "./rows.js";

const FREE = "free";
const MAX_TRAIL_FRAMES = 250;

/** @type {Record<import("../model/theme.js").ThemeChoice, string>} */
const THEMES = { system: "As the system", dark: "Dark", light: "Light" };

/** @typedef {"bodies" | "cameras" | "images" | "floor" | "gizmos" | "ghost" | "voxels"} Layer */

/** @type {{name: Layer, label: string, title: string}[]} */
const LAYERS = [
  { name: "bodies", label: "Bodies", title: "Draw the bodies in the 3-D view" },
  { name: "cameras", label: "Cameras", title: "Draw the cameras; a click on one looks through it" },
  { name: "images", label: "Camera images", title: "Show the image of each camera, a moment after the frame changes" },
  { name: "floor", label: "Floor grid", title: "Draw a grid on the floor with a line every 50 cm" },
  { name: "gizmos", label: "Gizmos", title: "Draw the handles that move the body and turn the selected joint" },
  { name: "ghost", label: "Predicted pose", title: "Draw in grey the pose that the tracker predicts for this frame from the poses before it" },
  { name: "voxels", label: "Voxels", title: "Draw the voxels that agree with the silhouettes of the shown frame, in the colours of the parts of the bodies" },
];

/**
 * @param {import("../model/index.js").Context} context
 * @param {import("../scene/index.js").SceneRoom} scene
 * @param {import("../panes/index.js").Panes} panes
 * @returns {import("./inspector.js").Section}
 */
export function viewSection({ store, send, themes, layers: paneLayers }, { floor }, panes) {
  const set = (/** @type {import("../model/protocol.js").View3dChanges} */ changes) => send({ type: "view_3d", changes });
  const theme = choiceRow("Theme", "Colour scheme of the page and the 3-D view; kept in this browser", THEMES, (value) => themes.choose(value));
  const linking = "All camera views show the place that one is zoomed to, at the same size of the people";
  const link = checkRow("Link zoom", linking, () => panes.grid.toggleLink());
  const errors =
    "Draw around each joint of the selected person the ellipse that holds 90% of its error in the camera view. " +
    "Errors come from tracking; a pose changed by hand has none";
  const ellipses = checkRow("Error ellipses", errors, (on) => paneLayers.toggle(["errors"], on));
  const noErrors = sectionNote("The errors of this pose are not known: they come from tracking over the whole run.");
  const looking = "Look through a camera, its image behind the bodies (Y: the camera under the pointer). Turning the view leaves the camera";
  const camera = choiceRow("Look through", looking, NO_OPTIONS, (value) => send({ type: "snap", camera: value === FREE ? null : Number(value) }));
  const layers = LAYERS.map(({ name, label, title }) => ({ name, row: checkRow(label, title, (on) => set({ [name]: on })) }));
  const coloring = "Each part of a body, or each person, in a colour of its own";
  const colors = choiceRow("Colours", coloring, { parts: "By part", people: "By person" }, (value) => set({ colors: value }));
  const opacity = sliderRow("Opacity", "Opacity of the bodies. Lower it to see what they hide", {
    min: 0.1,
    max: 1,
    step: 0.05,
    format: (value) => `${Math.round(100 * value)}%`,
    change: (value) => set({ opacity: value }),
  });
  const beside = "Show another body that moves as each person does, beside them in the 3-D view";
  const character = choiceRow("Character", beside, NO_OPTIONS, (value) => set({ character: value }));
  const prediction = sectionNote();
  const floorText = sectionNote();
  const setFloor = textButton("Set floor…", "Click three points of the floor in the views", () => floor.toggle());
  const fromFeet = textButton("From feet", "Set the floor to the plane under the feet in all poses", () => floor.setFromFeet());
  const formerFloor = textButton("Previous floor", "Restore the floor before the last change", () => floor.revert());
  const trails = sliderRow("Trail length", "Length of a trail to either side of the shown frame, frames: blue before it, orange after it", {
    min: 1,
    max: MAX_TRAIL_FRAMES,
    step: 1,
    format: String,
    change: (value) => set({ trail_frames: value }),
  });
  const points = make("div", { className: "trail-points", role: "group", "aria-label": "Points with a trail" });
  const noTrails = textButton("No trails", "Remove all trails", () => set({ trail_points: [] }));
  const [bodies, ...others] = layers.map(({ row }) => row.element);
  const body = make(
    "div", {}, theme.element, link.element, ellipses.element, noErrors, make("h4", {}, "3-D view"), camera.element, bodies, colors.element, opacity.element, ...others, prediction, character.element,
    make("h4", {}, "Floor"), floorText, buttons(setFloor, fromFeet, formerFloor),
    make("h4", {}, "Trails"), trails.element, points, buttons(noTrails),
  ); // prettier-ignore
  let built = "";

  const show = () => {
    const { view3d, state, session, linkedViews, theme: chosen, layers: { shown } } = store.facts;
    theme.show(chosen.choice);
    link.show(linkedViews);
    ellipses.show(shown.errors);
    noErrors.hidden = !shown.errors || state?.expected_errors_m.length !== 0;
    const cameras = session?.cameras.map(({ name }) => name) ?? [];
    camera.fill([[FREE, "Free view"], ...cameras.map((name, i) => [String(i), name])]);
    camera.show(state?.snapped == null ? FREE : String(state.snapped));
    character.fill([["", "None"], ...(view3d?.characters ?? []).map((name) => [name, name])]);
    if (!view3d) return;
    const { view } = view3d;
    for (const { name, row } of layers) row.show(view[name]);
    colors.show(view.colors);
    opacity.show(view.opacity);
    character.show(view.character);
    prediction.textContent = view3d.prediction && `Prediction ${view3d.prediction}`;
    prediction.hidden = !view3d.prediction;
    floorText.textContent = describe(view3d.floor);
    formerFloor.disabled = !view3d.floor.has_former;
    trails.show(view.trail_frames);
    noTrails.disabled = view.trail_points.length === 0;
    if (built !== view3d.trail_points.join()) {
      built = view3d.trail_points.join();
      points.replaceChildren(...view3d.trail_points.map((name) => pointChoice(name, choose)));
    }
    for (const box of points.querySelectorAll("input")) box.checked = view.trail_points.includes(box.value);
  };
  const choose = (/** @type {string} */ name, /** @type {boolean} */ on) => {
    const chosen = store.facts.view3d?.view.trail_points ?? [];
    set({ trail_points: on ? [...chosen, name] : chosen.filter((other) => other !== name) });
  };
  store.on(["view3d", "state", "session", "theme", "linkedViews", "layers"], show);
  return { id: "view", title: "View", hint: "Theme of the page, error ellipses, and what the 3-D view shows", body };
}

/**
 * @param {string} name
 * @param {(name: string, on: boolean) => void} choose
 */
function pointChoice(name, choose) {
  const { element, input } = checkbox(displayName(name), `Trail of the ${displayName(name)}`, { value: name });
  input.addEventListener("change", () => choose(name, input.checked));
  return element;
}

/** @param {import("../model/protocol.js").FloorInfo} floor */
function describe({ up, tilt_deg, height_m, origin }) {
  if (tilt_deg === null || height_m === null) return `From the calibration, ${up} is up`;
  return `Set${origin && ` from ${origin}`}: ${tilt_deg.toFixed(1)}° off ${up}, at ${(100 * height_m).toFixed(1)} cm`;
}

/** @param {HTMLElement[]} all */
function buttons(...all) {
  return make("div", "section-buttons", ...all);
}
