/**
 * Delay animation frames of the 3-D view in software rendering. A frame keeps both cores busy for longer than the panes can
 * wait, and viser renders one each second even if nothing changes.
 */

/** Interval of frames while the panes change or a run is active: about 5% of the time. */
const THROTTLE_MS = 5000;
/** Time after the last frame change during which the panes still count as changing. */
const SETTLED_MS = 250;
/** No delay for this long after loading, when the view fades in, and after resizing, when it is empty. */
const [LOADED_MS, RESIZED_MS] = [8000, 500];

/**
 * @param {HTMLIFrameElement} scene
 * @param {import("../model/store.js").Store} store
 */
export function pauseScene(scene, store) {
  let sought = -Infinity;
  let drawn = -Infinity;
  let freeUntil = -Infinity;
  store.on(["target", "shown"], () => (sought = performance.now()));
  scene.addEventListener("load", () => {
    release(LOADED_MS);
    if (scene.contentWindow) holdBack(scene.contentWindow);
  });
  new ResizeObserver(() => release(RESIZED_MS)).observe(scene);

  /** @param {number} forMs */
  function release(forMs) {
    freeUntil = Math.max(freeUntil, performance.now() + forMs);
  }

  /** Whether an animation frame must wait. */
  function waits() {
    const { state, dragging, shown, target } = store.facts;
    if (scene.closest(".is-scene-folded")) return true;
    const now = performance.now();
    if (now < freeUntil) return false;
    if (dragging) return true;
    // No delay while the user works with it, or while it shows a camera's view together with the image.
    if (scene.matches(":hover") || (state?.snapped ?? null) !== null) return false;
    const isPassing = shown?.frame !== target || now < sought + SETTLED_MS;
    const isAtWork = state?.job.running || state?.track.running;
    return (isPassing || isAtWork) && now < drawn + THROTTLE_MS;
  }

  /** @param {Window} view whose animation frames are delayed until it is reloaded */
  function holdBack(view) {
    const request = view.requestAnimationFrame.bind(view);
    const cancel = view.cancelAnimationFrame.bind(view);
    /** @type {Map<number, number>} delayed requests, with the browser's current number for each */
    const waiting = new Map();
    view.requestAnimationFrame = (callback) => {
      const attempt = () =>
        request((time) => {
          if (waits()) {
            waiting.set(number, attempt());
            return;
          }
          waiting.delete(number);
          drawn = performance.now();
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
