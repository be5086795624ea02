/** Walk through doubtful and lost poses and doubted keyframes by severity, and accept those that are right. */

import { zoomOnArrival } from "../panes/arrival_zoom.js";
import { displayName } from "../widgets/text.js";
import { listDoubts } from "./doubts.js";

export class DoubtQueue {
  #store;
  #navigation;
  #actions;
  #zoomTo;
  /** @type {import("./doubts.js").Doubt[] | null} null if it must be listed again */
  #listed = null;
  /** Rank of the entry that was visited last. When it is resolved, the next one takes its place. */
  #rank = -1;

  /**
   * @param {import("../model/store.js").Store} store
   * @param {import("../model/navigation.js").Navigation} navigation
   * @param {import("../model/actions.js").Actions} actions
   * @param {import("../panes/pane_grid.js").PaneGrid} grid
   */
  constructor(store, navigation, actions, grid) {
    this.#store = store;
    this.#navigation = navigation;
    this.#actions = actions;
    this.#zoomTo = zoomOnArrival(store, grid);
    store.on(["timeline", "lanes", "session", "keyframeDoubts"], () => (this.#listed = null));
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
    return this.current ? null : "The active person has no doubtful or lost pose here. Open the list of doubts for the most severe one.";
  }

  /** @param {import("./doubts.js").Doubt} doubt */
  visit(doubt) {
    this.#rank = this.doubts.indexOf(doubt);
    this.#navigation.pause();
    this.#navigation.goTo(doubt.worst);
    this.#select(doubt, doubt.worst);
  }

  /**
   * Select the limb in doubt on a frame that was just requested, and zoom to it; of the active person if possible.
   *
   * @param {number} frame
   */
  arriveAt(frame) {
    const here = this.doubts.filter(({ first, last }) => frame >= first && frame <= last);
    const doubt = here.find(({ person }) => person === this.#store.facts.state?.person) ?? here[0];
    if (doubt) this.#select(doubt, frame);
  }

  /**
   * @param {import("./doubts.js").Doubt} doubt
   * @param {number} frame
   */
  #select({ person, limb, keyframe }, frame) {
    const info = this.#store.facts.session?.people[person];
    if (!info) return;
    const far = info.points.find((point) => keyframe && displayName(point) === keyframe.point);
    const name = far ? info.point_limbs[far]?.name : limb === null ? null : info.limbs[limb];
    const points = info.points.filter((point) => info.point_limbs[point]?.name === name);
    const point = far ?? points.at(-1) ?? null;
    const { state } = this.#store.facts;
    if (state?.person !== person || state.point !== point) this.#actions.selectPerson(person, point);
    this.#zoomTo(points.length ? { person, frame, points } : null);
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
    this.visit(doubts[Math.max(0, Math.min(doubts.length - 1, at + way))]);
  }

  /**
   * Mark all poses of an entry as reviewed and confirm its keyframe, so that it leaves the queue.
   *
   * @param {import("./doubts.js").Doubt | null} doubt
   */
  accept(doubt) {
    if (!doubt || !this.#store.facts.connected) return;
    this.#rank = this.doubts.indexOf(doubt);
    for (const span of doubt.spans) this.#actions.review({ person: doubt.person, ...span });
    if (doubt.keyframe) this.#actions.confirmKeyframe(doubt.keyframe);
  }
}
