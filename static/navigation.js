/**
 * Which frame is asked for. One request is under way at a time and the newest wish waits behind it: however fast a hand
 * scrubs or a clip plays, the program is never more than one frame behind.
 */

import { isDoubt } from "./protocol.js";

const GIVE_UP_MS = 2000;
const GAP_MS = 500;

export class Navigation {
  #store;
  #send;
  /** @type {{frame: number} | null} */
  #underWay = null;
  /** @type {number | null} */
  #wish = null;
  /** Where playback counts from. */
  #anchor = { frame: 0, time: 0, tick: 0 };

  /**
   * @param {import("./store.js").Store} store
   * @param {(message: import("./protocol.js").ClientMessage) => void} send
   */
  constructor(store, send) {
    this.#store = store;
    this.#send = send;
    store.subscribe((changed) => {
      if (changed.has("connected")) this.#reset();
      if (changed.has("shown") || changed.has("state")) this.#arrived();
    });
  }

  get #last() {
    return (this.#store.facts.session?.n_frames ?? 1) - 1;
  }

  /**
   * Go to a frame; one outside the recording means its nearest end.
   *
   * @param {number} frame
   */
  goTo(frame) {
    if (!this.#store.facts.session || !this.#store.facts.connected) return;
    const target = Math.max(0, Math.min(this.#last, Math.round(frame)));
    this.#anchor = { frame: target, time: performance.now(), tick: performance.now() };
    this.#request(target);
  }

  /** @param {number} count frames forward, or backward where negative */
  step(count) {
    this.pause();
    this.goTo(this.#store.facts.target + count);
  }

  /**
   * Go to the nearest frame in one direction that the tracker calls doubtful or lost.
   *
   * @param {1 | -1} way
   */
  toDoubt(way) {
    const { timeline, target } = this.#store.facts;
    let nearest = null;
    for (const [frame, { status }] of timeline) {
      const isAhead = way * (frame - target) > 0;
      if (isAhead && isDoubt(status) && (nearest === null || way * (frame - nearest) < 0)) nearest = frame;
    }
    this.pause();
    if (nearest !== null) this.goTo(nearest);
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

  togglePlay() {
    const { playing, target, session, connected } = this.#store.facts;
    if (playing || !session || !connected) return this.pause();
    this.#store.set({ playing: true });
    this.goTo(target >= this.#last ? 0 : target);
    requestAnimationFrame((now) => this.#tick(now));
  }

  /** @param {number} now */
  #tick(now) {
    const { playing, session } = this.#store.facts;
    if (!playing || !session) return;
    if (now - this.#anchor.tick > GAP_MS) {
      // A hidden tab draws nothing: go on from where it stood instead of jumping.
      this.#anchor = { frame: this.#store.facts.target, time: now, tick: now };
    }
    this.#anchor.tick = now;
    const due = this.#anchor.frame + Math.floor(((now - this.#anchor.time) * session.fps) / 1000);
    if (due >= this.#last) {
      this.pause();
      this.#request(this.#last);
      return;
    }
    if (!this.#underWay && due > this.#store.facts.target) this.#request(due);
    requestAnimationFrame((then) => this.#tick(then));
  }

  /** @param {number} frame */
  #request(frame) {
    this.#store.set({ target: frame });
    this.#wish = frame;
    if (!this.#underWay) this.#sendWish();
  }

  #sendWish() {
    this.#underWay = null;
    if (this.#wish === null) return;
    const frame = this.#wish;
    this.#wish = null;
    const { shown, state } = this.#store.facts;
    if (shown?.frame === frame && state?.frame === frame) return;
    const request = { frame };
    this.#underWay = request;
    this.#send({ type: "seek", frame });
    // Another tab may have led the program elsewhere before it got there: then those images never come.
    setTimeout(() => {
      if (this.#underWay !== request) return;
      this.#sendWish();
      this.#arrived();
    }, GIVE_UP_MS);
  }

  #arrived() {
    const { shown, state, target } = this.#store.facts;
    if (this.#underWay && shown?.frame === this.#underWay.frame) this.#sendWish();
    // Another tab, an undo or a tracker may have gone elsewhere.
    if (!this.#underWay && this.#wish === null && state && state.frame !== target) {
      this.#store.set({ target: state.frame });
    }
  }

  #reset() {
    this.#underWay = null;
    this.#wish = null;
    this.pause();
  }
}
