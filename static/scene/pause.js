/**
 * Lets the 3-D view's animation frames wait where no graphics card draws them: one takes both cores for longer than a pane has time,
 * and viser draws one each second even where nothing changes.
 */

/** So seldom it is drawn while frames go by or something is at work: a twentieth of the time may go there. */
const THROTTLE_MS = 5000;
/** Frames still go by until one has been shown for so long. */
const SETTLED_MS = 250;
/** So long nothing waits: once it is loaded it fades in, and in another size it is empty until it is drawn. */
const [LOADED_MS, RESIZED_MS] = [8000, 500];

export class ScenePause {
  #scene;
  #store;
  #sought = -Infinity;
  #drawn = -Infinity;
  #freeUntil = -Infinity;

  /**
   * @param {HTMLIFrameElement} scene
   * @param {import("../model/store.js").Store} store
   */
  constructor(scene, store) {
    this.#scene = scene;
    this.#store = store;
    store.subscribe((changed) => {
      if (changed.has("target") || changed.has("shown")) this.#sought = performance.now();
    });
    scene.addEventListener("load", () => {
      this.#release(LOADED_MS);
      if (scene.contentWindow) this.#holdBack(scene.contentWindow);
    });
    new ResizeObserver(() => this.#release(RESIZED_MS)).observe(scene);
  }

  /** @param {number} forMs */
  #release(forMs) {
    this.#freeUntil = Math.max(this.#freeUntil, performance.now() + forMs);
  }

  /** Whether an animation frame has to wait. */
  get #waits() {
    const { state, dragging, shown, target } = this.#store.facts;
    const now = performance.now();
    if (now < this.#freeUntil) return false;
    if (dragging) return true;
    // Whoever points at it works with it; the view through a camera belongs to its image.
    if (this.#scene.matches(":hover") || (state?.snapped ?? null) !== null) return false;
    const isPassing = shown?.frame !== target || now < this.#sought + SETTLED_MS;
    const isAtWork = state?.job.running || state?.track.running;
    return (isPassing || isAtWork) && now < this.#drawn + THROTTLE_MS;
  }

  /** @param {Window} view whose animation frames wait from now on, until it is loaded anew */
  #holdBack(view) {
    const request = view.requestAnimationFrame.bind(view);
    const cancel = view.cancelAnimationFrame.bind(view);
    /** @type {Map<number, number>} the requests that wait, and the browser's number for each */
    const waiting = new Map();
    view.requestAnimationFrame = (callback) => {
      const attempt = () =>
        request((time) => {
          if (this.#waits) {
            waiting.set(number, attempt());
            return;
          }
          waiting.delete(number);
          this.#drawn = performance.now();
          callback(time);
        });
      const number = attempt();
      waiting.set(number, number);
      return number;
    };
    view.cancelAnimationFrame = (number) => {
      cancel(waiting.get(number) ?? number);
      waiting.delete(number);
    };
  }
}
