/** Brightness, contrast and gamma of each camera's image, stored in this browser per session. */

import { stored } from "../widgets/stored.js";

/**
 * @typedef {{brightness: number, contrast: number, gamma: number}} ImageTone
 *   brightness and contrast from -100 to 100, gamma from 0.2 to 5
 */

/** @type {Readonly<ImageTone>} */
export const PLAIN = { brightness: 0, contrast: 0, gamma: 1 };
/** @type {Record<keyof ImageTone, [number, number]>} */
const BOUNDS = { brightness: [-100, 100], contrast: [-100, 100], gamma: [0.2, 5] };
const STORED = "quadrille.looks.";

/** @param {ImageTone | undefined} tone */
export function isPlain(tone) {
  return !tone || (tone.brightness === 0 && tone.contrast === 0 && tone.gamma === 1);
}

/**
 * Map each of the 256 gray levels to its displayed value: gamma first, then contrast about the middle, then brightness.
 *
 * @param {ImageTone} tone
 */
export function toneCurve({ brightness, contrast, gamma }) {
  const gain = contrast >= 0 ? 1 / (1.001 - contrast / 100) : 1 + contrast / 100;
  return Uint8ClampedArray.from({ length: 256 }, (_, level) => {
    const raised = (level / 255) ** (1 / gamma);
    return Math.round(255 * (gain * (raised - 0.5) + 0.5 + brightness / 100));
  });
}

/** @typedef {ReturnType<typeof makeImageTones>} ImageTones */

/** @param {import("./store.js").Store} store */
export function makeImageTones(store) {
  let name = "";
  store.on(["session"], restore);

  /**
   * @param {number} camera
   * @param {ImageTone} tone
   */
  const set = (camera, tone) => save(Object.assign([...store.facts.imageTones], { [camera]: tone }));

  /** @param {ImageTone} tone for all cameras */
  const setAll = (tone) => save((store.facts.session?.cameras ?? []).map(() => tone));

  /** @param {(ImageTone | undefined)[]} imageTones by camera */
  function save(imageTones) {
    store.set({ imageTones });
    const names = (store.facts.session?.cameras ?? []).map(({ name }) => name);
    const changed = names.map((name, camera) => [name, imageTones[camera]]).filter(([, tone]) => tone && tone !== PLAIN);
    localStorage.setItem(STORED + name, JSON.stringify(Object.fromEntries(changed)));
  }

  function restore() {
    const { session } = store.facts;
    if (!session) return;
    name = session.name;
    const found = stored(STORED + name);
    store.set({ imageTones: session.cameras.map((camera) => restored(found?.[camera.name])) });
  }

  return { set, setAll };
}

/** @param {Partial<ImageTone> | undefined} found */
function restored(found) {
  const tone = { ...PLAIN };
  for (const field of /** @type {(keyof ImageTone)[]} */ (Object.keys(BOUNDS))) {
    const value = found?.[field];
    const [min, max] = BOUNDS[field];
    if (typeof value === "number" && value >= min && value <= max) tone[field] = value;
  }
  return tone;
}
