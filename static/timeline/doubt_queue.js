/** Walk through the doubtful and lost poses by severity, and accept those that are right. */

import { listDoubts } from "./doubts.js";

export class DoubtQueue {
  #store;
  #navigation;
  #actions;
  /** @type {import("./doubts.js").Doubt[] | null} null if it must be listed again */
  #listed = null;
  /** Rank of the entry that was visited last. When it is resolved, the next one takes its place. */
  #rank = -1;

  /**
   * @param {import("../model/store.js").Store} store
   * @param {import("../model/navigation.js").Navigation} navigation
   * @param {import("../model/actions.js").Actions} actions
   */
  constructor(store, navigation, actions) {
    this.#store = store;
    this.#navigation = navigation;
    this.#actions = actions;
    store.subscribe((changed) => {
      if (changed.has("timeline") || changed.has("lanes") || changed.has("session")) this.#listed = null;
    });
  }

  /** The unresolved doubts, the most severe first. */
  get doubts() {
    this.#listed ??= listDoubts(this.#store.facts);
    return this.#listed;
  }

  /** The entry of the requested frame, of the active person if possible; null if there is none. */
  get current() {
    const { target, state } = this.#store.facts;
    const here = this.doubts.filter(({ first, last }) => target >= first && target <= last);
    return here.find(({ person }) => person === state?.person) ?? null;
  }

  /** Why there is nothing to walk through; null if there is something. */
  get why() {
    return this.doubts.length > 0 ? null : "There is no doubtful or lost frame left.";
  }

  /** Why there is nothing to accept; null if there is something. */
  get whyNotAccept() {
    return this.current ? null : "The active person has no doubtful or lost pose here. Alt+↓ goes to the most severe one.";
  }

  /** @param {import("./doubts.js").Doubt} doubt */
  visit(doubt) {
    this.#rank = this.doubts.indexOf(doubt);
    this.#navigation.pause();
    if (doubt.person !== this.#store.facts.state?.person) this.#actions.selectPerson(doubt.person);
    this.#navigation.goTo(doubt.worst);
  }

  /**
   * Visit the next less or more severe entry.
   *
   * @param {1 | -1} way
   */
  step(way) {
    const { doubts, current } = this;
    if (doubts.length === 0) return;
    const at = current ? doubts.indexOf(current) : way > 0 ? this.#rank - 1 : this.#rank;
    const rank = Math.max(0, Math.min(doubts.length - 1, at + way));
    this.visit(doubts[rank]);
  }

  /**
   * Mark all poses of an entry as reviewed, so that it leaves the queue.
   *
   * @param {import("./doubts.js").Doubt | null} doubt
   */
  accept(doubt) {
    if (!doubt || !this.#store.facts.connected) return;
    this.#rank = this.doubts.indexOf(doubt);
    this.#actions.review(doubt);
  }
}
