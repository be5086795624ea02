/**
 * First steps: the shortest way from a new session to a tracked one. Shown in each session until the user closes them
 * there or it has tracked poses; the palette shows them again.
 */

import { NO_POSE, SOURCES } from "../model/cells.js";
import { hasTrack } from "../model/selectors.js";
import { button, byId } from "../widgets/elements.js";

const STORED = "quadrille.first_steps.";
const BY_A_RUN = ["tracked", "smoothed"].map((source) => SOURCES.indexOf(source));
/** A body that nobody has placed, with a higher cost, stands too far from the person to be found by a search, px. */
const FAR_PX = 10;

export class FirstSteps {
  #store;
  #row = byId("first-steps", HTMLElement);
  #place = byId("first-place", HTMLElement);
  #search = byId("first-search", HTMLElement);
  #fit = byId("first-fit", HTMLElement);
  #track = byId("first-track", HTMLElement);
  /** Whether the user has asked for the first steps. */
  #isAsked = false;
  /** Whether the last state had a tracking run; null before the first state. */
  #wasTracking = /** @type {boolean | null} */ (null);

  /**
   * @param {import("../model/store.js").Store} store
   * @param {() => void} findPeople
   * @param {() => void} newSession opens the form
   */
  constructor(store, findPeople, newSession) {
    this.#store = store;
    button("first-find", findPeople);
    button("first-new-session", newSession);
    button("close-first-steps", () => this.#close());
    this.#row.addEventListener("keydown", (event) => {
      if (event.key !== "Escape") return;
      event.preventDefault();
      this.#close();
    });
    store.on(["session"], () => this.#begin());
    store.on(["state"], () => this.#follow());
    store.on(["timeline"], () => (this.#row.hidden ||= !this.#isAsked && this.#isTracked()));
  }

  /** Show the first steps and focus their button. */
  show() {
    this.#isAsked = true;
    this.#row.hidden = false;
    byId("close-first-steps", HTMLButtonElement).focus();
  }

  #begin() {
    const isOne = (this.#store.facts.session?.people.length ?? 1) < 2;
    byId("first-body", HTMLElement).hidden = !isOne;
    byId("first-each", HTMLElement).hidden = isOne;
    this.#showPlace(!isOne);
    this.#isAsked = false;
    this.#row.hidden = localStorage.getItem(STORED + this.#store.facts.session?.name) === "seen";
  }

  /** Whether the session has a pose of a tracking run. */
  #isTracked() {
    const { sources } = this.#store.facts.timeline;
    return sources.some((source) => source !== NO_POSE && BY_A_RUN.includes(source));
  }

  /** @param {boolean} isShown whether the first step is to place the people */
  #showPlace(isShown) {
    this.#place.hidden = !isShown;
    byId("first-off", HTMLElement).hidden = isShown;
  }

  /** Tick the steps that are done. */
  #follow() {
    const { state } = this.#store.facts;
    if (!state) return;
    if (this.#place.hidden && state.people[0].source === null && (state.cost_px ?? 0) > FAR_PX) this.#showPlace(true);
    const done = (/** @type {HTMLElement} */ step) => step.classList.add("is-done");
    if (state.people.every(({ source }) => source !== null)) done(this.#place);
    if (state.compared?.work === "search" || state.job.message) done(this.#search);
    if (state.compared?.work === "fit") done(this.#fit);
    if (hasTrack(state)) done(this.#track);
    if (this.#wasTracking === false && hasTrack(state)) this.#close();
    this.#wasTracking = hasTrack(state);
  }

  #close() {
    localStorage.setItem(STORED + this.#store.facts.session?.name, "seen");
    this.#row.hidden = true;
  }
}
