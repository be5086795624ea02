/** Actions of the user that send messages, shared by buttons and keys. */

import { scopePerson, hasTrack, personCells } from "./selectors.js";

/** Poses on both sides that are estimated with one that was corrected: farther ones hardly change. */
const ESTIMATED_AROUND = 4;

/** @typedef {ReturnType<typeof makeActions>} Actions */

/**
 * @param {import("./store.js").Store} store
 * @param {(message: import("./protocol.js").ClientMessage) => void} send
 */
export function makeActions(store, send) {
  /** Range that was marked to estimate it: the next frame has another. @type {import("./store.js").Facts["range"]} */
  let around = null;

  /**
   * Process the marked range.
   *
   * @param {import("./protocol.js").RangeAction} action
   * @param {number | null} person null for all people
   */
  function onRange(action, person) {
    const { range } = store.facts;
    if (range) send({ type: "range", action, first: range.first, last: range.last, person });
  }

  /** @param {boolean} follow */
  const follow = (follow) => send({ type: "follow", follow });

  /**
   * @param {number} person
   * @param {string | null} point
   */
  const selectPerson = (person, point = null) => send({ type: "select", person, point });

  /**
   * Show or hide a person in all views.
   *
   * @param {number} person
   * @param {boolean} shown
   */
  const showPerson = (person, shown) => send({ type: "people", action: "show", person, shown });

  return {
    onRange,
    follow,
    selectPerson,
    showPerson,
    undo: () => send({ type: "undo" }),
    redo: () => send({ type: "redo" }),
    stopTracking: () => send({ type: "track", action: "stop" }),
    stopRange: () => send({ type: "stop_range" }),
    /** @param {"step" | "stage" | "frame" | "contours" | "chains" | "stop"} action */
    search: (action) => send({ type: "search", action, person: scopePerson(store.facts) }),
    /** Repeat the selected run from its start pose with the current settings. */
    searchAgain: () => send({ type: "search", action: "again", run: store.facts.searchRun, person: scopePerson(store.facts) }),
    /** @param {import("./protocol.js").CurveGroup | null} group */
    openCurves: (group) => send({ type: "curves", group }),

    /** End the replay of a search. Returns whether one was shown. */
    leaveReplay() {
      if (!store.facts.state?.replay) return false;
      // Otherwise the next step of the replay could be sent before the program has answered.
      store.set({ replaying: false });
      send({ type: "replay", run: null, step: 0 });
      return true;
    },

    /** Show the pose before the last fit or search, or its result. */
    toggleBefore() {
      const { state } = store.facts;
      if (state?.compared) send({ type: "before", shown: !state.compared.is_before_shown });
    },

    /** Show the result of the last fit or search again. Returns whether the pose before was shown. */
    leaveBefore() {
      if (!store.facts.state?.compared?.is_before_shown) return false;
      send({ type: "before", shown: false });
      return true;
    },

    /**
     * Track from the current frame to the end of the recording, or of the marked range if that lies ahead.
     *
     * @param {"forward" | "backward"} way
     */
    track(way) {
      const { range, state } = store.facts;
      if (!state) return;
      const end = way === "forward" ? range?.last : range?.first;
      const isAhead = end !== undefined && (way === "forward" ? end > state.frame : end < state.frame);
      send({ type: "track", action: way, until: isAhead ? end : null });
    },

    /** Pause the tracking run, or continue it if it is paused. */
    togglePause() {
      const { state } = store.facts;
      if (hasTrack(state)) send({ type: "track", action: state?.track.running ? "pause" : "resume" });
    },

    /** Estimate the poses of the marked range again, or mark the frames around the shown one and estimate those. */
    estimateAgain() {
      const { range, timeline, target } = store.facts;
      if (!range || range === around) {
        around = timeline.around(target, ESTIMATED_AROUND);
        store.set({ range: around });
      }
      onRange("estimate", null);
    },

    /**
     * Mark the poses of a person in some frames as reviewed.
     *
     * @param {{person: number, first: number, last: number}} poses `last` is included
     */
    review: (poses) => send({ type: "range", action: "reviewed", ...poses }),

    /**
     * Keep a doubted keyframe as it is.
     *
     * @param {{person: number, frame: number}} keyframe
     */
    confirmKeyframe: ({ person, frame }) => send({ type: "confirm_keyframe", person, frame }),

    /** @param {boolean} on whether to compare the marked range, or to end the comparison */
    compareRange(on) {
      const { range } = store.facts;
      if (!on) send({ type: "compare_range", first: null, last: null });
      else if (range) send({ type: "compare_range", first: range.first, last: range.last });
    },

    /**
     * Take the replaced poses of the compared range, or of a stretch of one person.
     *
     * @param {{person: number | null, first: number, last: number}} [stretch] `last` is included
     */
    takeReplaced(stretch) {
      const { first, last } = store.facts.rangeComparison ?? { first: null, last: null };
      if (stretch) send({ type: "range", action: "take_replaced", ...stretch });
      else if (first !== null && last !== null) send({ type: "range", action: "take_replaced", first, last, person: null });
    },

    /**
     * Toggle a mark of the active person's pose on the current frame.
     *
     * @param {"keyframe" | "reviewed"} toggle
     */
    toggleMark: (toggle) => store.facts.connected && send({ type: "mark", toggle }),

    /** Remove the marks of the active person's pose on the current frame. */
    unmark() {
      const { connected, state, target } = store.facts;
      if (!connected || !state || !personCells(store.facts).has(target)) return;
      send({ type: "range", action: "none", first: target, last: target, person: state.person });
    },

    toggleFollow() {
      const { state } = store.facts;
      if (state && hasTrack(state)) follow(!state.follow);
    },

    /**
     * Select the next or the previous person.
     *
     * @param {1 | -1} way
     */
    stepPerson(way) {
      const { state, session } = store.facts;
      const count = session?.people.length ?? 0;
      if (state && count > 1) selectPerson((state.person + way + count) % count);
    },

    /** Show or hide the active person. */
    toggleShown() {
      const { state } = store.facts;
      if (state && state.people.length > 1) showPerson(state.person, !state.people[state.person].shown);
    },

    /** Dim all people except the active one (toggle). */
    toggleSolo() {
      const { state } = store.facts;
      if (state && state.people.length > 1) send({ type: "people", action: "solo", on: !state.solo });
    },

    /** Switch searches and fits between all people and the active person. */
    toggleScope() {
      const { scope, session } = store.facts;
      if ((session?.people.length ?? 0) > 1) store.set({ scope: scope === "all" ? "one" : "all" });
    },
  };
}
