/**
 * While a frame is on its way the nearest one at hand stands in for it: its images only, marked in each pane, and nothing that
 * a hand could take. Frames that come at once, as in playing, need none.
 */

/** So far a frame may be away and so long take before another stands in: it may be decoded already. */
const [STEP, PATIENCE_MS] = [2, 25];

export class PlaceholderFrames {
  #store;
  #recent;
  /** @type {number | null} the frame that is waited for */
  #awaited = null;

  /**
   * @param {import("../model/store.js").Store} store
   * @param {import("../model/recent_images.js").RecentImages} recent
   */
  constructor(store, recent) {
    this.#store = store;
    this.#recent = recent;
    store.subscribe((changed) => {
      if (["target", "shown", "playing", "connected"].some((fact) => changed.has(/** @type {any} */ (fact)))) this.#look();
    });
  }

  /** The frame to wait for, or null where nothing has to stand in. */
  get #late() {
    const { connected, shown, state, target, playing } = this.#store.facts;
    const follows = state?.track.running && state.follow; // then the program is always a little ahead
    return connected && shown && !playing && !follows && shown.frame !== target ? target : null;
  }

  #look() {
    const late = this.#late;
    if (late === this.#awaited) return;
    this.#awaited = late;
    if (late === null) this.#store.facts.placeholder && this.#store.set({ placeholder: null });
    // A hand that scrubs on sees the next one at once, and so does who goes far: the true one takes its time.
    else if (this.#store.facts.placeholder || Math.abs(late - (this.#store.facts.shown?.frame ?? late)) > STEP) this.#stand();
    else setTimeout(() => this.#stand(), PATIENCE_MS);
  }

  /** Let the nearest frame stand in. */
  #stand() {
    const { shown, reductions } = this.#store.facts;
    const target = this.#awaited;
    if (target === null) return;
    const cameras = [...reductions.keys()].filter((camera) => reductions[camera] > 0);
    const nearest = this.#recent.nearest(target, cameras);
    const isNearer = nearest !== null && shown && Math.abs(nearest - target) < Math.abs(shown.frame - target);
    if (isNearer) this.#store.set({ placeholder: { frame: nearest, target, pictures: this.#recent.of(nearest) } });
    else this.#store.set({ placeholder: { frame: shown?.frame ?? 0, target, pictures: null } });
  }
}
