/** Questions about the state that several rooms ask. */

/**
 * Whom searches and fits move; null for everybody.
 *
 * @param {import("./store.js").Facts} facts
 */
export function scopePerson({ scope, state }) {
  return scope === "one" && state ? state.person : null;
}

/**
 * Whether a person is dimmed, and out of reach of a hand: another is worked on alone.
 *
 * @param {import("./protocol.js").StateMessage | null} state
 * @param {number} person
 */
export function isDimmed(state, person) {
  return !!state?.solo && person !== state.person;
}

/**
 * Whether there is a search to stop: one that runs, or one that waits between two steps.
 *
 * @param {import("./protocol.js").StateMessage | null} state
 */
export function hasSearch(state) {
  return !!state && (state.job.running || state.job.kind !== null);
}

/**
 * Whether there is a tracking run: one at work, or one that is paused.
 *
 * @param {import("./protocol.js").StateMessage | null} state
 */
export function hasTrack(state) {
  return !!state && state.track.first !== null;
}
