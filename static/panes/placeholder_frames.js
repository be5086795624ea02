/**
 * Show the nearest cached frame while the requested frame is loading. Only its images are shown, marked in each pane, and
 * nothing can be dragged. Frames that load quickly, as in playback, need no placeholder.
 */

/** Frames farther away than this get a placeholder immediately, nearer ones after a delay. */
const [STEP, PATIENCE_MS] = [2, 25];

export class PlaceholderFrames {
  #store;
  #recent;
  /** @type {number | null} the frame that is loading */
  #loading = null;

  /**
   * @param {import("../model/store.js").Store} store
   * @param {import("../model/recent_images.js").RecentImages} recent
   */
  constructor(store, recent) {
    this.#store = store;
    this.#recent = recent;
    store.on(["target", "shown", "playing", "connected"], () => this.#update());
  }

  /** The frame that is loading; null if no placeholder is needed. */
  get #loadingFrame() {
    const { connected, shown, state, target, playing } = this.#store.facts;
    const follows = state?.track.running && state.follow; // then the program is always slightly ahead
    return connected && shown && !playing && !follows && shown.frame !== target ? target : null;
  }

  #update() {
    const loading = this.#loadingFrame;
    if (loading === this.#loading) return;
    this.#loading = loading;
    if (loading === null) this.#store.facts.placeholder && this.#store.set({ placeholder: null });
    // While scrubbing, and for distant frames, show the placeholder immediately.
    else if (this.#store.facts.placeholder || Math.abs(loading - (this.#store.facts.shown?.frame ?? loading)) > STEP) this.#showNearest();
    else setTimeout(() => this.#showNearest(), PATIENCE_MS);
  }

  /** Show the nearest cached frame. */
  #showNearest() {
    const { shown, reductions } = this.#store.facts;
    const target = this.#loading;
    if (target === null) return;
    const cameras = [...reductions.keys()].filter((camera) => reductions[camera] > 0);
    const nearest = this.#recent.nearest(target, cameras);
    const isNearer = nearest !== null && shown && Math.abs(nearest - target) < Math.abs(shown.frame - target);
    if (isNearer) this.#store.set({ placeholder: { frame: nearest, target, pictures: this.#recent.of(nearest) } });
    else this.#store.set({ placeholder: { frame: shown?.frame ?? 0, target, pictures: null } });
  }
}
