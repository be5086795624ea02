/**
 * Request frames from the program. Only one request is pending at a time, and only the newest further request is kept.
 * Scrubbing and playback are therefore never more than one frame ahead of the program.
 */

const TIMEOUT_MS = 2000;

export class Navigation {
  #store;
  #send;
  /** @type {{frame: number} | null} */
  #pending = null;
  /** @type {number | null} */
  #next = null;
  /** Whether the program may show another frame before it obeys the next request. */
  #isMoving = false;

  /**
   * @param {import("./store.js").Store} store
   * @param {(message: import("./protocol.js").ClientMessage) => void} send
   */
  constructor(store, send) {
    this.#store = store;
    this.#send = send;
    store.on(["connected"], () => this.#reset());
    store.on(["shown", "state"], () => this.#arrived());
    store.on(["state"], () => (this.#isMoving &&= this.#pending !== null));
  }

  get #last() {
    return (this.#store.facts.session?.n_frames ?? 1) - 1;
  }

  /** Expect that the program goes to another frame by itself: an undo goes to the frame of its edit. */
  expectMove() {
    this.#isMoving = true;
  }

  /**
   * Go to a frame, clamped to the recording.
   *
   * @param {number} frame
   */
  goTo(frame) {
    const { session, connected } = this.#store.facts;
    if (!session || !connected || !session.has_place) return;
    this.request(Math.max(0, Math.min(this.#last, Math.round(frame))));
  }

  /** @param {number} count negative to go back */
  step(count) {
    this.pause();
    this.goTo(this.#store.facts.target + count);
  }

  first() {
    this.goTo(0);
  }

  last() {
    this.goTo(this.#last);
  }

  pause() {
    if (this.#store.facts.playing) this.#store.set({ playing: false });
  }

  /** Whether a request is pending. */
  get isWaiting() {
    return this.#pending !== null;
  }

  /**
   * Request a frame of the recording.
   *
   * @param {number} frame
   */
  request(frame) {
    this.#store.set({ target: frame });
    this.#next = frame === this.#pending?.frame ? null : frame;
    if (!this.#pending) this.#sendNext();
  }

  #sendNext() {
    this.#pending = null;
    if (this.#next === null) return;
    const frame = this.#next;
    this.#next = null;
    if (!this.#isMoving && this.#isAt(frame)) return;
    const request = { frame };
    this.#pending = request;
    this.#send({ type: "seek", frame });
    // Another tab may have requested a different frame. Then these images never arrive.
    setTimeout(() => {
      if (this.#pending !== request) return;
      this.#sendNext();
      this.#arrived();
    }, TIMEOUT_MS);
  }

  #arrived() {
    const { shown, state, target } = this.#store.facts;
    const { frame } = this.#pending ?? {};
    if (this.#pending && shown?.frame === frame && (!this.#isMoving || state?.frame === frame)) this.#sendNext();
    // Another tab, an undo or a tracker may have changed the frame.
    if (!this.#pending && this.#next === null && state && state.frame !== target) {
      this.#store.set({ target: state.frame });
    }
  }

  /** @param {number} frame */
  #isAt(frame) {
    const { shown, state } = this.#store.facts;
    return shown?.frame === frame && state?.frame === frame;
  }

  #reset() {
    this.#pending = null;
    this.#next = null;
    this.#isMoving = false;
    this.pause();
  }
}
