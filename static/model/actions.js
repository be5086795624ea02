/** What a user can want, whichever button or key says it. */

import { scopePerson, hasTrack } from "./selectors.js";

export class Actions {
  #store;
  #send;

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

  /** @param {"step" | "stage" | "frame" | "stop"} action */
  search(action) {
    this.#send({ type: "search", action, person: scopePerson(this.#store.facts) });
  }

  /** Search again from where the run that is looked at began, by the settings of now. */
  searchAgain() {
    const { facts } = this.#store;
    this.#send({ type: "search", action: "again", run: facts.searchRun, person: scopePerson(facts) });
  }

  /** Show the true pose again, where a search is replayed; whether there was something to leave. */
  leaveReplay() {
    if (!this.#store.facts.state?.replay) return false;
    // Else its next step would lead back into the replay before the program has answered.
    this.#store.set({ replaying: false });
    this.#send({ type: "replay", run: null, step: 0 });
    return true;
  }

  /**
   * Track from the shown frame to the end of the recording, or of the marked range where that lies ahead.
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

  /** Pause a tracking run that is at work, go on with one that is paused. */
  togglePause() {
    const { state } = this.#store.facts;
    if (hasTrack(state)) this.#send({ type: "track", action: state?.track.running ? "pause" : "resume" });
  }

  stopTracking() {
    this.#send({ type: "track", action: "stop" });
  }

  /**
   * Work on the marked range.
   *
   * @param {import("./protocol.js").RangeAction} action
   * @param {number | null} person null for everybody
   */
  onRange(action, person) {
    const { range } = this.#store.facts;
    if (range) this.#send({ type: "range", action, first: range.first, last: range.last, person });
  }

  stopRange() {
    this.#send({ type: "stop_range" });
  }

  /**
   * Mark the shown pose of the person worked on, or take the mark back.
   *
   * @param {"keyframe" | "reviewed"} toggle
   */
  toggleMark(toggle) {
    if (this.#store.facts.connected) this.#send({ type: "mark", toggle });
  }

  /** Take the marks of the shown pose of the person worked on away. */
  unmark() {
    const { connected, state, target, timeline } = this.#store.facts;
    if (!connected || !state || !timeline.has(target)) return;
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

  /** @param {number} person */
  selectPerson(person) {
    this.#send({ type: "select", person, point: null });
  }

  /**
   * Work on the next person, or the one before.
   *
   * @param {1 | -1} way
   */
  stepPerson(way) {
    const { state, session } = this.#store.facts;
    const count = session?.people.length ?? 0;
    if (state && count > 1) this.selectPerson((state.person + way + count) % count);
  }

  /**
   * Show a person in all views, or nowhere.
   *
   * @param {number} person
   * @param {boolean} shown
   */
  showPerson(person, shown) {
    this.#send({ type: "people", action: "show", person, shown });
  }

  /** Show or hide the person worked on. */
  toggleShown() {
    const { state } = this.#store.facts;
    if (state && state.people.length > 1) this.showPerson(state.person, !state.people[state.person].shown);
  }

  /** Dim everybody but the person worked on, or no more. */
  toggleSolo() {
    const { state } = this.#store.facts;
    if (state && state.people.length > 1) this.#send({ type: "people", action: "solo", on: !state.solo });
  }

  /** Let searches and fits move everybody, or the person worked on alone. */
  toggleScope() {
    const { scope, session } = this.#store.facts;
    if ((session?.people.length ?? 0) > 1) this.#store.set({ scope: scope === "all" ? "one" : "all" });
  }
}
