/** Walk through doubtful and lost poses and doubted keyframes by severity, and accept those that are right. */

import { zoomOnArrival } from "../panes/arrival_zoom.js";
import { displayName } from "../widgets/text.js";
import { listDoubts } from "./doubts.js";

/** @typedef {ReturnType<typeof makeDoubtQueue>} DoubtQueue */

/**
 * @param {import("../model/store.js").Store} store
 * @param {import("../model/navigation.js").Navigation} navigation
 * @param {import("../model/actions.js").Actions} actions
 * @param {import("../panes/pane_grid.js").PaneGrid} grid
 */
export function makeDoubtQueue(store, navigation, actions, grid) {
  const zoomTo = zoomOnArrival(store, grid);
  /** @type {import("./doubts.js").Doubt[] | null} null if it must be listed again */
  let listed = null;
  /** Rank of the entry that was visited last. When it is resolved, the next one takes its place. */
  let rank = -1;

  store.on(["timeline", "lanes", "session", "keyframeDoubts"], () => (listed = null));

  /** The unresolved doubts, the most severe first. */
  const doubts = () => (listed ??= listDoubts(store.facts));

  /** @param {number} frame */
  const doubtsOn = (frame) => doubts().filter(({ first, last }) => frame >= first && frame <= last);

  /** The entry of the requested frame, of the active person if possible; null if there is none. */
  const current = () => doubtsOn(store.facts.target).find(({ person }) => person === store.facts.state?.person) ?? null;

  /** Why there is nothing to walk through; null if there is something. */
  const why = () => (doubts().length > 0 ? null : "There is no doubtful or lost frame left.");

  /** Why there is nothing to accept; null if there is something. */
  const whyNotAccept = () =>
    current() ? null : "The active person has no doubtful or lost pose here. Open the list of doubts for the most severe one.";

  /** @param {import("./doubts.js").Doubt} doubt */
  function visit(doubt) {
    rank = doubts().indexOf(doubt);
    navigation.pause();
    navigation.goTo(doubt.worst);
    select(doubt, doubt.worst);
  }

  /**
   * Select the limb in doubt on a frame that was just requested, and zoom to it; of the active person if possible.
   *
   * @param {number} frame
   */
  function arriveAt(frame) {
    const here = doubtsOn(frame);
    const doubt = here.find(({ person }) => person === store.facts.state?.person) ?? here[0];
    if (doubt) select(doubt, frame);
  }

  /**
   * @param {import("./doubts.js").Doubt} doubt
   * @param {number} frame
   */
  function select({ person, limb, keyframe }, frame) {
    const info = store.facts.session?.people[person];
    if (!info) return;
    const far = info.points.find((point) => keyframe && displayName(point) === keyframe.point);
    const name = far ? info.point_limbs[far]?.name : limb === null ? null : info.limbs[limb];
    const points = info.points.filter((point) => info.point_limbs[point]?.name === name);
    const point = far ?? points.at(-1) ?? null;
    const { state } = store.facts;
    if (state?.person !== person || state.point !== point) actions.selectPerson(person, point);
    zoomTo(points.length ? { person, frame, points } : null);
  }

  /**
   * Visit the next less or more severe entry.
   *
   * @param {1 | -1} way
   */
  function step(way) {
    const [all, here] = [doubts(), current()];
    if (all.length === 0) return;
    const at = here ? all.indexOf(here) : way > 0 ? rank - 1 : rank;
    visit(all[Math.max(0, Math.min(all.length - 1, at + way))]);
  }

  /**
   * Mark all poses of an entry as reviewed and confirm its keyframe, so that it leaves the queue.
   *
   * @param {import("./doubts.js").Doubt | null} doubt
   */
  function accept(doubt) {
    if (!doubt || !store.facts.connected) return;
    rank = doubts().indexOf(doubt);
    for (const span of doubt.spans) actions.review({ person: doubt.person, ...span });
    if (doubt.keyframe) actions.confirmKeyframe(doubt.keyframe);
  }

  return { doubts, current, why, whyNotAccept, visit, arriveAt, step, accept };
}
