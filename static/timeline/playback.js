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

/** @typedef {ReturnType<typeof makePlayback>} Playback */

/**
 * @param {import("../model/store.js").Store} store
 * @param {import("../model/navigation.js").Navigation} navigation
 */
export function makePlayback(store, navigation) {
  /** Frame and time from which due frames are counted. */
  let anchor = { frame: 0, time: 0 };
  let ticked = 0;
  /** The frame requested last. */
  let requested = 0;
  /** Timer of the next look at the clock. */
  let timer = 0;
  store.on(["rate", "everyFrame"], () => (anchor = here()));
  store.on(["shown"], () => store.facts.playing && tick(performance.now()));

  function toggle() {
    const { playing, session, connected, target } = store.facts;
    if (playing || !session || !connected) return navigation.pause();
    const { first, last } = getInterval();
    const isOutside = target < first || target >= last;
    store.set({ playing: true });
    anchor = { frame: isOutside ? first : target, time: performance.now() };
    ticked = performance.now();
    ask(anchor.frame);
    rest();
  }

  function toggleLoop() {
    store.set({ loops: !store.facts.loops });
  }

  function toggleEveryFrame() {
    store.set({ everyFrame: !store.facts.everyFrame });
  }

  /** @param {1 | -1} way to the next faster or slower speed */
  function changeRate(way) {
    const at = RATES.indexOf(store.facts.rate);
    store.set({ rate: RATES[Math.max(0, Math.min(RATES.length - 1, at + way))] });
  }

  /** @param {number} rate one of `RATES` */
  function setRate(rate) {
    if (RATES.includes(rate)) store.set({ rate });
  }

  /** First and last frame to play: the marked range in a loop, else the whole recording. */
  function getInterval() {
    const { session, range, loops } = store.facts;
    return loops && range ? range : { first: 0, last: (session?.n_frames ?? 1) - 1 };
  }

  function here() {
    return { frame: store.facts.target, time: performance.now() };
  }

  /**
   * Rest until the next frame is due. An animation frame each time the screen is drawn would have the browser lay out and
   * compose the page again, also where nothing changes.
   */
  function rest() {
    const { session, rate, target } = store.facts;
    const nextMs = anchor.time + ((target + 1 - anchor.frame) * 1000) / ((session?.fps ?? 1) * rate) - performance.now();
    const restMs = Math.min(MAX_REST_MS, navigation.isWaiting() ? MAX_REST_MS : nextMs - ANIMATION_FRAME_MS);
    clearTimeout(timer);
    timer = setTimeout(() => requestAnimationFrame((now) => tick(now)), restMs);
  }

  /** @param {number} now */
  function tick(now) {
    const { playing, session } = store.facts;
    if (!playing || !session) return;
    advance(now, session);
    rest();
  }

  /**
   * Ask for the frame that is due, if it is not asked for yet.
   *
   * @param {number} now
   * @param {import("../model/protocol.js").SessionMessage} session
   */
  function advance(now, session) {
    const { rate, everyFrame, target, loops } = store.facts;
    // A hidden tab draws nothing, and the user may have gone elsewhere: continue from the current frame.
    // The next frame is due now, so that slow machines still make progress.
    if (now - ticked > GAP_MS) anchor = { frame: target + 1, time: now };
    if (target !== requested) {
      requested = target;
      anchor = here();
    }
    ticked = now;
    if (navigation.isWaiting()) return;
    const { first, last } = getInterval();
    let due = anchor.frame + Math.floor(((now - anchor.time) * session.fps * rate) / 1000);
    if (everyFrame && due > target + 1) {
      due = target + 1;
      anchor = { frame: due, time: now }; // late frames are not made up for
    }
    if (due > last || (due >= last && !loops)) {
      if (loops) anchor = { frame: first, time: now };
      else navigation.pause();
      ask(loops ? first : last);
    } else if (due > target) {
      ask(due);
    }
  }

  /** @param {number} frame */
  function ask(frame) {
    requested = frame;
    navigation.request(frame);
  }

  return { toggle, toggleLoop, toggleEveryFrame, changeRate, setRate };
}
