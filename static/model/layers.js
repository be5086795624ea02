/**
 * Layers of the panes: visibility, opacity and defaults. Each browser stores its own choice per session.
 */

import { stored } from "../widgets/stored.js";

/**
 * @typedef {import("./protocol.js").Layer} Layer
 * @typedef {"person" | "part"} ContourColors
 * @typedef {{shown: Record<Layer, boolean>, opacity: Record<Layer, number>, colors: ContourColors}} LayerChoice
 *
 * @typedef {object} LayerInfo
 * @property {Layer} id
 * @property {string} group
 * @property {string} label
 * @property {string} title
 * @property {boolean} shown by default
 * @property {number} opacity by default
 */

/** @type {LayerInfo[]} in painting order, bottom first */
export const LAYERS = [
  { id: "image", group: "Picture", label: "Image", title: "Undistorted camera image", shown: true, opacity: 1 },
  {
    id: "faces", group: "Picture", label: "Blurred faces", shown: false, opacity: 1,
    title: "Heads of all people who are placed, reduced to a few grains in this page; exports have a choice of their own",
  },
  {
    id: "distance", group: "Evidence", label: "Distance", shown: false, opacity: 0.7,
    title: "Distance to the nearest edge: bright at edges, dark beyond the outlier distance",
  },
  {
    id: "silhouette", group: "Evidence", label: "Silhouette", shown: false, opacity: 0.45,
    title: "Pixels that masks or background subtraction assign to people",
  },
  { id: "rejected", group: "Evidence", label: "Rejected edges", title: "Edges not explained by the pose", shown: false, opacity: 0.8 },
  { id: "accepted", group: "Evidence", label: "Accepted edges", title: "Edges explained by the pose", shown: false, opacity: 1 },
  { id: "parts", group: "Model", label: "Part masks", title: "Image area of each body part, nearest on top", shown: false, opacity: 0.5 },
  {
    id: "part_edges", group: "Model", label: "Part edges", shown: false, opacity: 0.75,
    title: "Borders between body parts inside the silhouette, which are not matched",
  },
  {
    id: "hidden", group: "Model", label: "Hidden contours", shown: false, opacity: 0.8,
    title: "Occluded contours of the model, dashed; hidden with the contours",
  },
  { id: "contours", group: "Model", label: "Contours", title: "Contours of the model, and of the poses compared with it", shown: true, opacity: 1 },
  { id: "skeleton", group: "Model", label: "Skeleton", title: "Lines between the joints", shown: false, opacity: 0.8 },
  { id: "joints", group: "Model", label: "Joints", title: "Joints, which can be dragged", shown: true, opacity: 1 },
  {
    id: "observability", group: "Model", label: "Observability", shown: false, opacity: 1,
    title: "How well the cameras constrain each joint of the selected person: a ring, dashed where weakly, double where not",
  },
  {
    id: "errors", group: "Model", label: "Error ellipses", shown: false, opacity: 0.9,
    title: "Ellipses that hold 90% of the error of each joint of the selected person in the view, known from tracking",
  },
  {
    id: "alternatives", group: "Model", label: "Alternatives", shown: true, opacity: 1,
    title: "Other poses that fit about as well, numbered where the reason of the pose is shown",
  },
  {
    id: "epipolar", group: "Model", label: "Epipolar lines", shown: true, opacity: 0.9,
    title: "Lines of sight of the dragged joint and of the selected joint's pins, in the other views",
  },
  {
    id: "imported", group: "Evidence", label: "Imported points", shown: true, opacity: 0.9,
    title: "Points of the imported observations that the inspector shows: crosses joined by lines, red where the footage says they are off",
  },
  {
    id: "axes", group: "Evidence", label: "Silhouette axes", shown: true, opacity: 0.9,
    title: "Major axes of the silhouettes on the frame on which people were found, later approximations lighter (GD96 Fig. 5)",
  },
]; // prettier-ignore

/** Layers that are images, in painting order. */
export const PICTURE_LAYERS = /** @type {const} */ (["image", "distance", "silhouette", "parts"]);

const STORED = "quadrille.layers.";

/**
 * @param {number} people number of people of the session; with several, occluded contours are shown by default
 * @returns {LayerChoice}
 */
export function defaultLayers(people = 1) {
  const table = (/** @type {"shown" | "opacity"} */ field) => Object.fromEntries(LAYERS.map((l) => [l.id, l[field]]));
  const usual = /** @type {LayerChoice} */ ({ shown: table("shown"), opacity: table("opacity"), colors: "person" });
  if (people > 1) usual.shown.hidden = true;
  return usual;
}

/** @typedef {ReturnType<typeof makeLayers>} Layers */

/** @param {import("./store.js").Store} store */
export function makeLayers(store) {
  /** Whether hidden contours were shown when all contours were hidden, to be shown with them again. */
  let hadHidden = false;
  let session = "";
  store.on(["session"], () => restore());

  /**
   * Show or hide layers.
   *
   * @param {Layer[]} ids
   * @param {boolean} [isShown] default: show all, or hide all if all are shown
   */
  function toggle(ids, isShown) {
    const { layers } = store.facts;
    const show = isShown ?? !ids.every((id) => layers.shown[id]);
    const shown = { ...layers.shown };
    for (const id of ids) shown[id] = show;
    if (ids.includes("contours") && !ids.includes("hidden") && show !== layers.shown.contours) {
      // Dashed contours are contours, too: alone they would stay where the user wants to see the picture.
      if (!show) hadHidden = layers.shown.hidden;
      shown.hidden = show && (layers.shown.hidden || hadHidden);
    }
    save({ ...layers, shown });
  }

  /**
   * @param {Layer} id
   * @param {number} opacity 0 to 1
   */
  function setOpacity(id, opacity) {
    const { layers } = store.facts;
    save({ ...layers, opacity: { ...layers.opacity, [id]: opacity } });
  }

  /** @param {ContourColors} colors */
  function setColors(colors) {
    save({ ...store.facts.layers, colors });
  }

  function reset() {
    save(defaultLayers(store.facts.session?.people.length));
  }

  /** @param {LayerChoice} layers */
  function save(layers) {
    store.set({ layers });
    localStorage.setItem(STORED + session, JSON.stringify(layers));
  }

  function restore() {
    const { name = "", people = [] } = store.facts.session ?? {};
    if (name === session) return;
    session = name;
    store.set({ layers: restored(stored(STORED + name) ?? {}, people.length) });
  }

  return { toggle, setOpacity, setColors, reset };
}

/**
 * @param {Partial<LayerChoice>} found
 * @param {number} people
 */
function restored(found, people) {
  const layers = defaultLayers(people);
  for (const { id } of LAYERS) {
    const [isShown, opacity] = [found.shown?.[id], found.opacity?.[id]];
    if (typeof isShown === "boolean") layers.shown[id] = isShown;
    if (typeof opacity === "number" && opacity >= 0 && opacity <= 1) layers.opacity[id] = opacity;
  }
  if (found.colors === "part") layers.colors = "part";
  return layers;
}
