/** Questions about the state that several rooms ask. */

/**
 * The only person that searches and fits move; null for all people.
 *
 * @param {import("./store.js").Facts} facts
 */
export function scopePerson({ scope, state }) {
  return scope === "one" && state ? state.person : null;
}

/**
 * Whether a person is dimmed and cannot be dragged, because another person is solo.
 *
 * @param {import("./protocol.js").StateMessage | null} state
 * @param {number} person
 */
export function isDimmed(state, person) {
  return !!state?.solo && person !== state.person;
}

/**
 * Whether a joint is drawn as visible: nothing occludes it, or only a dimmed person does.
 *
 * @param {import("./protocol.js").StateMessage | null} state
 * @param {import("./protocol.js").Handle} handle
 */
export function isInSight(state, { visible, hidden_by }) {
  return visible || (hidden_by !== null && isDimmed(state, hidden_by));
}

/**
 * Whether the views show the stored poses, whose joints can be dragged, and no replayed or former ones.
 *
 * @param {import("./protocol.js").StateMessage | null} state
 */
export function isStoredDrawn(state) {
  return !state?.replay && !state?.compared?.is_before_shown;
}

/**
 * Cells of the person worked on.
 *
 * @param {import("./store.js").Facts} facts
 */
export function personCells({ lanes, timeline, state }) {
  return (state && lanes[state.person]) ?? timeline;
}

/** @type {WeakMap<number[][][], Set<number>[]>} */
const EARLIER = new WeakMap();

/**
 * Frames of each person with poses of an earlier calibration.
 *
 * @param {import("./store.js").Facts} facts
 * @returns {Set<number>[]}
 */
export function earlierCalibration({ calibration }) {
  if (!calibration) return [];
  let found = EARLIER.get(calibration.outdated);
  if (!found) {
    found = calibration.outdated.map(
      (intervals) => new Set(intervals.flatMap(([first, last]) => Array.from({ length: last - first + 1 }, (_, i) => first + i))),
    );
    EARLIER.set(calibration.outdated, found);
  }
  return found;
}

/**
 * @typedef {import("./protocol.js").CopyDifferenceInfo & {person: number}} Difference
 */

/**
 * Poses on which the other copy differs by more than the tolerance and nobody has decided, by person and frame.
 *
 * @param {import("./store.js").Facts} facts
 * @returns {Difference[]}
 */
export function copyDifferences({ otherCopy: copy }) {
  if (!copy) return [];
  return copy.people.flatMap((of, person) => of.filter((one) => !one.decided && one.distance_mm > copy.tolerance_mm).map((one) => ({ ...one, person })));
}

/**
 * How far the other copy differs about a person on a frame, if both annotated it.
 *
 * @param {import("./store.js").Facts} facts
 * @param {number} person
 * @param {number} frame
 */
export function differenceAt({ otherCopy }, person, frame) {
  return otherCopy?.people[person]?.find((one) => one.frame === frame);
}

/**
 * Arrows of the last check of the cameras that the views show: none while its correction is previewed.
 *
 * @param {import("./store.js").Facts} facts
 */
export function shownMisfits({ calibration, showsMisfits }) {
  return showsMisfits && calibration && !calibration.is_previewed ? calibration.misfits : [];
}

/**
 * Whether a search is running, or paused between two steps.
 *
 * @param {import("./protocol.js").StateMessage | null} state
 */
export function hasSearch(state) {
  return !!state && (state.job.running || state.job.kind !== null);
}

/**
 * Whether a tracking run is running or paused.
 *
 * @param {import("./protocol.js").StateMessage | null} state
 */
export function hasTrack(state) {
  return !!state && state.track.first !== null;
}

/**
 * Effect of the Stop button of a search.
 *
 * @param {boolean} isRunning whether the search is running
 */
export function stopTitle(isRunning) {
  return isRunning
    ? "Pause the search and keep the best pose; Step, Stage or Frame continue it (Esc)"
    : "End the paused search and keep the best pose (Esc)";
}

/**
 * The part and view that contradict the shown pose most, as in "left calf: outside the person in LEFT"; empty while unknown.
 *
 * @param {import("./store.js").Facts} facts
 */
export function reasonOf(facts) {
  return isExplained(facts) ? (facts.reason?.sentence ?? "") : "";
}

/**
 * Poses about as good as the shown one, or better, cheapest first; they are drawn and taken by their rank.
 *
 * @param {import("./store.js").Facts} facts
 */
export function alternativesOf(facts) {
  return isExplained(facts) ? (facts.reason?.alternatives ?? []) : [];
}

/** @param {import("./store.js").Facts} facts */
function isExplained({ reason, state }) {
  return !!reason && !!state && reason.frame === state.frame && reason.person === state.person;
}
