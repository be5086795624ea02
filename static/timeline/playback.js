/**
 * Playback in real time or at another speed, to the end or in a loop. Late frames are skipped, or waited for if every
 * frame is to be shown.
 */

const GAP_MS = 2000;
/** An animation frame: a due frame is asked for at most that early. */
const ANIMATION_FRAME_MS = 1000 / 60;
/** Longest time between two looks at the clock: a request may be given up, or another page may go elsewhere. */
const MAX_REST_MS = 100;

/** Playback speeds relative to real time. */
const RATES = [1 / 8, 1 / 4, 1 / 2, 1, 2, 4];

export class Playback {
  #store;
  #navigation;
  /** Frame and time from which due frames are counted. */
  #anchor = { frame: 0, time: 0 };
  #ticked = 0;
  /** The frame requested last. */
  #requested = 0;
  /** Timer of the next look at the clock. */
  #timer = 0;

  /**
   * @param {import("../model/store.js").Store} store
   * @param {import("../model/navigation.js").Navigation} navigation
   */
  constructor(store, navigation) {
    this.#store = store;
    this.#navigation = navigation;
    store.on(["rate", "everyFrame"], () => (this.#anchor = this.#here()));
    store.on(["shown"], () => store.facts.playing && this.#tick(performance.now()));
  }

  toggle() {
    const { playing, session, connected, target } = this.#store.facts;
    if (playing || !session || !connected) return this.#navigation.pause();
    const { first, last } = this.#interval;
    const isOutside = target < first || target >= last;
    this.#store.set({ playing: true });
    this.#anchor = { frame: isOutside ? first : target, time: performance.now() };
    this.#ticked = performance.now();
    this.#ask(this.#anchor.frame);
    this.#rest();
  }

  toggleLoop() {
    this.#store.set({ loops: !this.#store.facts.loops });
  }

  toggleEveryFrame() {
    this.#store.set({ everyFrame: !this.#store.facts.everyFrame });
  }

  /** @param {1 | -1} way to the next faster or slower speed */
  changeRate(way) {
    const at = RATES.indexOf(this.#store.facts.rate);
    this.#store.set({ rate: RATES[Math.max(0, Math.min(RATES.length - 1, at + way))] });
  }

  /** @param {number} rate one of `RATES` */
  setRate(rate) {
    if (RATES.includes(rate)) this.#store.set({ rate });
  }

  /** First and last frame to play: the marked range in a loop, else the whole recording. */
  get #interval() {
    const { session, range, loops } = this.#store.facts;
    return loops && range ? range : { first: 0, last: (session?.n_frames ?? 1) - 1 };
  }

  #here() {
    return { frame: this.#store.facts.target, time: performance.now() };
  }

  /**
   * Rest until the next frame is due. An animation frame each time the screen is drawn would have the browser lay out and
   * compose the page again, also where nothing changes.
   */
  #rest() {
    const { session, rate, target } = this.#store.facts;
    const nextMs = this.#anchor.time + ((target + 1 - this.#anchor.frame) * 1000) / ((session?.fps ?? 1) * rate) - performance.now();
    const restMs = Math.min(MAX_REST_MS, this.#navigation.isWaiting ? MAX_REST_MS : nextMs - ANIMATION_FRAME_MS);
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => requestAnimationFrame((now) => this.#tick(now)), restMs);
  }

  /** @param {number} now */
  #tick(now) {
    const { playing, session } = this.#store.facts;
    if (!playing || !session) return;
    this.#advance(now, session);
    this.#rest();
  }

  /**
   * Ask for the frame that is due, if it is not asked for yet.
   *
   * @param {number} now
   * @param {import("../model/protocol.js").SessionMessage} session
   */
  #advance(now, session) {
    const { rate, everyFrame, target, loops } = this.#store.facts;
    // A hidden tab draws nothing, and the user may have gone elsewhere: continue from the current frame.
    // The next frame is due now, so that slow machines still make progress.
    if (now - this.#ticked > GAP_MS) this.#anchor = { frame: target + 1, time: now };
    if (target !== this.#requested) {
      this.#requested = target;
      this.#anchor = this.#here();
    }
    this.#ticked = now;
    if (this.#navigation.isWaiting) return;
    const { first, last } = this.#interval;
    let due = this.#anchor.frame + Math.floor(((now - this.#anchor.time) * session.fps * rate) / 1000);
    if (everyFrame && due > target + 1) {
      due = target + 1;
      this.#anchor = { frame: due, time: now }; // late frames are not made up for
    }
    if (due > last || (due >= last && !loops)) {
      if (loops) this.#anchor = { frame: first, time: now };
      else this.#navigation.pause();
      this.#ask(loops ? first : last);
    } else if (due > target) {
      this.#ask(due);
    }
  }

  /** @param {number} frame */
  #ask(frame) {
    this.#requested = frame;
    this.#navigation.request(frame);
  }
}
