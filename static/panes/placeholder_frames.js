/**
 * Show the nearest cached frame while the requested frame is loading. Only its images are shown, marked in each pane, and
 * nothing can be dragged. Frames that load quickly, as in playback, need no placeholder.
 */

/** Frames farther away than this get a placeholder immediately, nearer ones after a delay. */
const [STEP, PATIENCE_MS] = [2, 25];

/**
 * @param {import("../model/store.js").Store} store
 * @param {import("../model/recent_images.js").RecentImages} recent
 */
export function showPlaceholders(store, recent) {
  /** @type {number | null} the frame that is loading */
  let awaited = null;
  store.on(["target", "shown", "playing", "connected"], update);

  /** The frame that is loading; null if no placeholder is needed. */
  function loadingFrame() {
    const { connected, shown, state, target, playing } = store.facts;
    const follows = state?.track.running && state.follow; // then the program is always slightly ahead
    return connected && shown && !playing && !follows && shown.frame !== target ? target : null;
  }

  function update() {
    const loading = loadingFrame();
    if (loading === awaited) return;
    awaited = loading;
    if (loading === null) store.facts.placeholder && store.set({ placeholder: null });
    // While scrubbing, and for distant frames, show the placeholder immediately.
    else if (store.facts.placeholder || Math.abs(loading - (store.facts.shown?.frame ?? loading)) > STEP) showNearest();
    else setTimeout(() => showNearest(), PATIENCE_MS);
  }

  /** Show the nearest cached frame. */
  function showNearest() {
    const { shown, reductions } = store.facts;
    const target = awaited;
    if (target === null) return;
    const nearest = recent.nearest(target, [...reductions.keys()].filter((camera) => reductions[camera] > 0));
    const isNearer = nearest !== null && shown && Math.abs(nearest - target) < Math.abs(shown.frame - target);
    if (isNearer) store.set({ placeholder: { frame: nearest, target, pictures: recent.of(nearest) } });
    else store.set({ placeholder: { frame: shown?.frame ?? 0, target, pictures: null } });
  }
}
