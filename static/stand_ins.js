/**
 * While a frame is on its way the nearest one at hand stands in for it: its images only, marked in each pane, and nothing that
 * a hand could take. Frames that come at once, as in playing, need none.
 */

const PATIENCE_MS = 25;

export class StandIns {
  #store;
  #recent;
  /** @type {number | null} the frame that is waited for */
  #awaited = null;
  #busy = false;

  /**
   * @param {import("./store.js").Store} store
   * @param {import("./recent_images.js").RecentImages} recent
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
    if (late === null) this.#show(null);
    // A hand that scrubs on sees the next one at once; who has just set out may have the true one before this.
    else if (this.#store.facts.standIn) void this.#stand();
    else setTimeout(() => void this.#stand(), PATIENCE_MS);
  }

  /** Let the nearest frame stand in; where the wish has changed by the time that it is decoded, the next one follows it. */
  async #stand() {
    while (!this.#busy && this.#awaited !== null) {
      const target = this.#awaited;
      const { shown, reductions } = this.#store.facts;
      const cameras = [...reductions.keys()].filter((camera) => reductions[camera] > 0);
      const nearest = this.#recent.nearest(target, cameras);
      if (nearest === null || !shown || Math.abs(nearest - target) >= Math.abs(shown.frame - target)) {
        this.#show({ frame: shown?.frame ?? 0, target, pictures: null });
        return;
      }
      this.#busy = true;
      const pictures = await this.#recent.decode(nearest, cameras).finally(() => (this.#busy = false));
      const awaited = this.#awaited;
      if (awaited !== null) this.#show({ frame: nearest, target: awaited, pictures });
      else close(pictures);
      if (awaited === target) return;
    }
  }

  /** @param {import("./store.js").StandIn | null} standIn */
  #show(standIn) {
    const former = this.#store.facts.standIn;
    if (former === standIn) return;
    this.#store.set({ standIn });
    close(former?.pictures);
  }
}

/** @param {import("./pictures.js").Pictures | null | undefined} pictures */
function close(pictures) {
  for (const { bitmap } of pictures?.values() ?? []) bitmap.close();
}
