/** Actions of the user that send messages, shared by buttons and keys. */

import { scopePerson, hasTrack, personCells } from "./selectors.js";

/** Poses on both sides that are estimated with one that was corrected: farther ones hardly change. */
const ESTIMATED_AROUND = 4;

export class Actions {
  #store;
  #send;
  /** Range that was marked to estimate it: the next frame has another. @type {import("./store.js").Facts["range"]} */
  #around = null;

  /**
   * @param {import("./store.js").Store} store
   * @param {(message: import("./protocol.js").ClientMessage) => void} send
   */
  constructor(store, send) {
    this.#store = store;
    this.#send = send;
  }

  undo() {
    this.#send({ type: "undo" });
  }

  redo() {
    this.#send({ type: "redo" });
  }

  /** @param {"step" | "stage" | "frame" | "contours" | "chains" | "stop"} action */
  search(action) {
    this.#send({ type: "search", action, person: scopePerson(this.#store.facts) });
  }

  /** Repeat the selected run from its start pose with the current settings. */
  searchAgain() {
    const { facts } = this.#store;
    this.#send({ type: "search", action: "again", run: facts.searchRun, person: scopePerson(facts) });
  }

  /** End the replay of a search. Returns whether one was shown. */
  leaveReplay() {
    if (!this.#store.facts.state?.replay) return false;
    // Otherwise the next step of the replay could be sent before the program has answered.
    this.#store.set({ replaying: false });
    this.#send({ type: "replay", run: null, step: 0 });
    return true;
  }

  /** Show the pose before the last fit or search, or its result. */
  toggleBefore() {
    const { state } = this.#store.facts;
    if (state?.compared) this.#send({ type: "before", shown: !state.compared.is_before_shown });
  }

  /** Show the result of the last fit or search again. Returns whether the pose before was shown. */
  leaveBefore() {
    if (!this.#store.facts.state?.compared?.is_before_shown) return false;
    this.#send({ type: "before", shown: false });
    return true;
  }

  /**
   * Track from the current frame to the end of the recording, or of the marked range if that lies ahead.
   *
   * @param {"forward" | "backward"} way
   */
  track(way) {
    const { range, state } = this.#store.facts;
    if (!state) return;
    const end = way === "forward" ? range?.last : range?.first;
    const isAhead = end !== undefined && (way === "forward" ? end > state.frame : end < state.frame);
    this.#send({ type: "track", action: way, until: isAhead ? end : null });
  }

  /** Pause the tracking run, or continue it if it is paused. */
  togglePause() {
    const { state } = this.#store.facts;
    if (hasTrack(state)) this.#send({ type: "track", action: state?.track.running ? "pause" : "resume" });
  }

  stopTracking() {
    this.#send({ type: "track", action: "stop" });
  }

  /**
   * Process the marked range.
   *
   * @param {import("./protocol.js").RangeAction} action
   * @param {number | null} person null for all people
   */
  onRange(action, person) {
    const { range } = this.#store.facts;
    if (range) this.#send({ type: "range", action, first: range.first, last: range.last, person });
  }

  /** Estimate the poses of the marked range again, or mark the frames around the shown one and estimate those. */
  estimateAgain() {
    const { range, timeline, target } = this.#store.facts;
    if (!range || range === this.#around) {
      this.#around = timeline.around(target, ESTIMATED_AROUND);
      this.#store.set({ range: this.#around });
    }
    this.onRange("estimate", null);
  }

  /**
   * Mark the poses of a person in some frames as reviewed.
   *
   * @param {{person: number, first: number, last: number}} poses `last` is included
   */
  review({ person, first, last }) {
    this.#send({ type: "range", action: "reviewed", first, last, person });
  }

  /**
   * Keep a doubted keyframe as it is.
   *
   * @param {{person: number, frame: number}} keyframe
   */
  confirmKeyframe({ person, frame }) {
    this.#send({ type: "confirm_keyframe", person, frame });
  }

  /** @param {boolean} on whether to compare the marked range, or to end the comparison */
  compareRange(on) {
    const { range } = this.#store.facts;
    if (!on) this.#send({ type: "compare_range", first: null, last: null });
    else if (range) this.#send({ type: "compare_range", first: range.first, last: range.last });
  }

  /**
   * Take the replaced poses of the compared range, or of a stretch of one person.
   *
   * @param {{person: number | null, first: number, last: number}} [stretch] `last` is included
   */
  takeReplaced(stretch) {
    const { first, last } = this.#store.facts.rangeComparison ?? { first: null, last: null };
    if (stretch) this.#send({ type: "range", action: "take_replaced", first: stretch.first, last: stretch.last, person: stretch.person });
    else if (first !== null && last !== null) this.#send({ type: "range", action: "take_replaced", first, last, person: null });
  }

  stopRange() {
    this.#send({ type: "stop_range" });
  }

  /**
   * Toggle a mark of the active person's pose on the current frame.
   *
   * @param {"keyframe" | "reviewed"} toggle
   */
  toggleMark(toggle) {
    if (this.#store.facts.connected) this.#send({ type: "mark", toggle });
  }

  /** Remove the marks of the active person's pose on the current frame. */
  unmark() {
    const { connected, state, target } = this.#store.facts;
    if (!connected || !state || !personCells(this.#store.facts).has(target)) return;
    this.#send({ type: "range", action: "none", first: target, last: target, person: state.person });
  }

  /** @param {boolean} follow */
  follow(follow) {
    this.#send({ type: "follow", follow });
  }

  toggleFollow() {
    const { state } = this.#store.facts;
    if (state && hasTrack(state)) this.follow(!state.follow);
  }

  /** @param {import("./protocol.js").CurveGroup | null} group */
  openCurves(group) {
    this.#send({ type: "curves", group });
  }

  /**
   * @param {number} person
   * @param {string | null} point
   */
  selectPerson(person, point = null) {
    this.#send({ type: "select", person, point });
  }

  /**
   * Select the next or the previous person.
   *
   * @param {1 | -1} way
   */
  stepPerson(way) {
    const { state, session } = this.#store.facts;
    const count = session?.people.length ?? 0;
    if (state && count > 1) this.selectPerson((state.person + way + count) % count);
  }

  /**
   * Show or hide a person in all views.
   *
   * @param {number} person
   * @param {boolean} shown
   */
  showPerson(person, shown) {
    this.#send({ type: "people", action: "show", person, shown });
  }

  /** Show or hide the active person. */
  toggleShown() {
    const { state } = this.#store.facts;
    if (state && state.people.length > 1) this.showPerson(state.person, !state.people[state.person].shown);
  }

  /** Dim all people except the active one (toggle). */
  toggleSolo() {
    const { state } = this.#store.facts;
    if (state && state.people.length > 1) this.#send({ type: "people", action: "solo", on: !state.solo });
  }

  /** Switch searches and fits between all people and the active person. */
  toggleScope() {
    const { scope, session } = this.#store.facts;
    if ((session?.people.length ?? 0) > 1) this.#store.set({ scope: scope === "all" ? "one" : "all" });
  }
}
