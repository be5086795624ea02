/** Brightness, contrast and gamma of each camera's image: in this browser only, kept session by session. */

/**
 * @typedef {{brightness: number, contrast: number, gamma: number}} Look
 *   brightness and contrast from -100 to 100, gamma from 0.2 to 5
 */

/** @type {Readonly<Look>} */
export const PLAIN = { brightness: 0, contrast: 0, gamma: 1 };
/** @type {Record<keyof Look, [number, number]>} */
const BOUNDS = { brightness: [-100, 100], contrast: [-100, 100], gamma: [0.2, 5] };
const STORED = "quadrille.looks.";

/** @param {Look | undefined} look */
export function isPlain(look) {
  return !look || (look.brightness === 0 && look.contrast === 0 && look.gamma === 1);
}

/**
 * The value that each of the 256 gray levels is shown with: gamma first, then contrast about the middle, then brightness.
 *
 * @param {Look} look
 */
export function toneCurve({ brightness, contrast, gamma }) {
  const gain = contrast >= 0 ? 1 / (1.001 - contrast / 100) : 1 + contrast / 100;
  return Uint8ClampedArray.from({ length: 256 }, (_, level) => {
    const raised = (level / 255) ** (1 / gamma);
    return Math.round(255 * (gain * (raised - 0.5) + 0.5 + brightness / 100));
  });
}

export class Looks {
  #store;
  #session = "";

  /** @param {import("./store.js").Store} store */
  constructor(store) {
    this.#store = store;
    store.subscribe((changed) => {
      if (changed.has("session")) this.#recall();
    });
  }

  /**
   * @param {number} camera
   * @param {Look} look
   */
  set(camera, look) {
    const looks = [...this.#store.facts.looks];
    looks[camera] = look;
    this.#keep(looks);
  }

  /** @param {Look} look for all cameras */
  setAll(look) {
    this.#keep((this.#store.facts.session?.cameras ?? []).map(() => look));
  }

  /** @param {(Look | undefined)[]} looks by camera */
  #keep(looks) {
    this.#store.set({ looks });
    const names = (this.#store.facts.session?.cameras ?? []).map(({ name }) => name);
    const changed = names.map((name, camera) => [name, looks[camera]]).filter(([, look]) => look && look !== PLAIN);
    localStorage.setItem(STORED + this.#session, JSON.stringify(Object.fromEntries(changed)));
  }

  #recall() {
    const { session } = this.#store.facts;
    if (!session) return;
    this.#session = session.name;
    /** @type {Record<string, Partial<Look>>} */
    let stored = {};
    try {
      stored = JSON.parse(localStorage.getItem(STORED + session.name) ?? "{}") ?? {};
    } catch {
      // What is not understood is as good as nothing.
    }
    this.#store.set({ looks: session.cameras.map(({ name }) => known(stored[name])) });
  }
}

/** @param {Partial<Look> | undefined} stored */
function known(stored) {
  const look = { ...PLAIN };
  for (const field of /** @type {(keyof Look)[]} */ (Object.keys(BOUNDS))) {
    const value = stored?.[field];
    const [least, most] = BOUNDS[field];
    if (typeof value === "number" && value >= least && value <= most) look[field] = value;
  }
  return look;
}
