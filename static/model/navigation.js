/**
 * Request frames from the program. Only one request is pending at a time, and only the newest further request is kept.
 * Scrubbing and playback are therefore never more than one frame ahead of the program.
 */

const TIMEOUT_MS = 2000;

/** @typedef {ReturnType<typeof makeNavigation>} Navigation */

/**
 * @param {import("./store.js").Store} store
 * @param {(message: import("./protocol.js").ClientMessage) => void} send
 */
export function makeNavigation(store, send) {
  /** @type {{frame: number} | null} */
  let pending = null;
  /** @type {number | null} */
  let next = null;
  /** Whether the program may show another frame before it obeys the next request. */
  let isMoving = false;

  store.on(["connected"], reset);
  store.on(["shown", "state"], arrived);
  store.on(["state"], () => (isMoving &&= pending !== null));

  const lastFrame = () => (store.facts.session?.n_frames ?? 1) - 1;

  /**
   * Go to a frame, clamped to the recording.
   *
   * @param {number} frame
   */
  function goTo(frame) {
    const { session, connected } = store.facts;
    if (!session || !connected || !session.has_place) return;
    request(Math.max(0, Math.min(lastFrame(), Math.round(frame))));
  }

  /** @param {number} count negative to go back */
  function step(count) {
    pause();
    goTo(store.facts.target + count);
  }

  function pause() {
    if (store.facts.playing) store.set({ playing: false });
  }

  /**
   * Request a frame of the recording.
   *
   * @param {number} frame
   */
  function request(frame) {
    store.set({ target: frame });
    next = frame === pending?.frame ? null : frame;
    if (!pending) sendNext();
  }

  function sendNext() {
    pending = null;
    if (next === null) return;
    const frame = next;
    next = null;
    if (!isMoving && isAt(frame)) return;
    const request = { frame };
    pending = request;
    send({ type: "seek", frame });
    // Another tab may have requested a different frame. Then these images never arrive.
    setTimeout(() => {
      if (pending !== request) return;
      sendNext();
      arrived();
    }, TIMEOUT_MS);
  }

  function arrived() {
    const { shown, state, target } = store.facts;
    const { frame } = pending ?? {};
    if (pending && shown?.frame === frame && (!isMoving || state?.frame === frame)) sendNext();
    // Another tab, an undo or a tracker may have changed the frame.
    if (!pending && next === null && state && state.frame !== target) {
      store.set({ target: state.frame });
    }
  }

  /** @param {number} frame */
  function isAt(frame) {
    const { shown, state } = store.facts;
    return shown?.frame === frame && state?.frame === frame;
  }

  function reset() {
    pending = next = null;
    isMoving = false;
    pause();
  }

  return {
    goTo,
    step,
    pause,
    request,
    first: () => goTo(0),
    last: () => goTo(lastFrame()),
    /** Whether a request is pending. */
    isWaiting: () => pending !== null,
    /** Expect that the program goes to another frame by itself: an undo goes to the frame of its edit. */
    expectMove: () => (isMoving = true),
  };
}
