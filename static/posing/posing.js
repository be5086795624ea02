/** Edit poses without a drag: selection, steps, mirror, copies, resets and locks. */

import { stored } from "../widgets/stored.js";

/** Minimum interval of messages while a key is held down. */
const SEND_MS = 50;
const REQUEST_MS = 1500;
const STEPS_KEY = "quadrille.steps";
const DEFAULT_STEPS = { cm: 1, deg: 5 };

/**
 * @typedef {{cm: number, deg: number}} Steps
 * @typedef {{right: number, up: number}} Way
 * @typedef {import("../model/protocol.js").PoseEdit} PoseEdit
 */

/**
 * An edit without the fields that all have.
 *
 * @template T
 * @typedef {T extends PoseEdit ? Omit<T, "type" | "frame" | "person"> & {frame?: number} : never} Change
 */

/** @typedef {ReturnType<typeof makePosing>} Posing */

/**
 * @param {import("../model/store.js").Store} store
 * @param {(message: import("../model/protocol.js").ClientMessage) => void} send
 */
export function makePosing(store, send) {
  /** Step sizes of the keys. */
  const steps = restoredSteps();
  /** @type {Map<string, PoseEdit>} steps that wait to be sent, by target */
  const waiting = new Map();
  let sentAt = -Infinity;
  /** @type {{point: string, at: number} | null} the joint requested last, until the program has confirmed it */
  let requested = null;

  store.subscribe((changed) => {
    if (requested?.point === store.facts.state?.point) requested = null;
    if (changed.has("state") || changed.has("session")) keepDof();
  });

  /** @param {Partial<Steps>} changes */
  function setSteps(changes) {
    Object.assign(steps, changes);
    localStorage.setItem(STEPS_KEY, JSON.stringify(steps));
  }

  /**
   * The active person, null before the session is known; the selected joint, if any; the joint to edit, which else is the
   * root, with the indices of its degrees of freedom; and its limb.
   */
  function joint() {
    const { session, state } = store.facts;
    const person = (state && session?.people[state.person]) ?? null;
    // Keys are faster than the program's answers. A request without an answer expires.
    const awaited = requested && performance.now() < requested.at + REQUEST_MS ? requested.point : null;
    const selected = awaited ?? state?.point ?? null;
    const point = selected ?? person?.points[0] ?? null;
    const dofs = (person && point && person.point_dofs[point]) || [];
    const limb = (person && point && person.point_limbs[point]) || { name: "", dofs: [] };
    return { person, selected, point, dofs, limb };
  }

  /**
   * Select the next or the previous joint.
   *
   * @param {1 | -1} way
   */
  function toJoint(way) {
    const { person, selected } = joint();
    if (!person) return;
    const points = person.points;
    const at = selected === null ? (way > 0 ? -1 : 0) : points.indexOf(selected);
    selectPoint(points[(at + way + points.length) % points.length]);
  }

  /** @param {string} point */
  function selectPoint(point) {
    const { state } = store.facts;
    if (!state) return;
    requested = { point, at: performance.now() };
    store.set({ state });
    send({ type: "select", person: state.person, point });
  }

  /** @param {number} dof */
  const selectDof = (dof) => dof !== store.facts.dof && store.set({ dof });

  /** Select the next degree of freedom of the joint. */
  function nextDof() {
    const { dofs } = joint();
    if (dofs.length) selectDof(dofs[(dofs.indexOf(store.facts.dof ?? -1) + 1) % dofs.length]);
  }

  /**
   * Move the joint parallel to the image plane of the active view, by a multiple of the step.
   *
   * @param {Way} way
   * @param {number} factor
   */
  function nudge(way, factor) {
    const { state, active, filled } = store.facts;
    if (!state) return;
    const camera = filled ?? active ?? 0;
    const [right, up] = [way.right * factor * steps.cm, way.up * factor * steps.cm];
    const point = joint().selected;
    gather(`nudge ${camera} ${point}`, { ...head(), action: "nudge", point, camera, right, up });
  }

  /**
   * Change the selected degree of freedom by a multiple of the step.
   *
   * @param {number} factor
   */
  function turn(factor) {
    const { dof } = store.facts;
    const info = dof === null ? undefined : joint().person?.dofs[dof];
    if (dof !== null && info) turnDofs([dof], factor * steps[info.unit]);
  }

  /**
   * Step degrees of freedom by a number of degrees or centimetres.
   *
   * @param {number[]} dofs
   * @param {number | null} by null takes the drag back
   * @param {{drag: number, frame: number} | null} drag its number and frame, from whose start the step counts
   */
  function turnDofs(dofs, by, drag = null) {
    const start = drag && { drag: drag.drag, frame: drag.frame };
    const step = { ...head(), ...start, action: /** @type {const} */ ("turn"), dofs, by };
    if (by === null) edit(step);
    else gather(`turn ${dofs} ${drag?.drag}`, step);
  }

  /**
   * @param {number} dof
   * @param {number} value in degrees or centimetres
   */
  const set = (dof, value) => edit({ action: "set", dof, value });

  /**
   * Set a value repeatedly, as a slider does. Only the newest waiting value is sent.
   *
   * @param {number} dof
   * @param {number} value in degrees or centimetres
   */
  const slide = (dof, value) => gather(`set ${dof}`, { ...head(), action: "set", dof, value });

  const mirror = () => edit({ action: "mirror" });

  /**
   * Switch to the best alternative pose, or back.
   *
   * @param {number} [rank] of another one among those of the reason
   */
  const takeAlternative = (rank) => edit({ action: "alternative", rank: rank ?? null });

  const resetLimb = () => edit({ action: "reset", point: joint().selected });

  /** @param {number} from */
  const copyFrom = (from) => edit({ action: "copy", from });

  /**
   * Copy the joint angles of another person on this frame; position and orientation stay.
   *
   * @param {number} from
   */
  function copyPerson(from) {
    if (from !== head().person) edit({ action: "copy_person", from });
  }

  /** Copy the joint angles of the next person in the list. */
  const copyNextPerson = () => copyPerson((head().person + 1) % (store.facts.session?.people.length ?? 1));

  /** @param {1 | -1} way */
  function copyNeighbour(way) {
    const from = head().frame + way;
    if (from >= 0 && from < (store.facts.session?.n_frames ?? 0)) copyFrom(from);
  }

  /**
   * Lock degrees of freedom, or unlock them if all are locked.
   *
   * @param {number[]} dofs
   */
  function toggleLock(dofs) {
    if (dofs.length) edit({ action: "lock", dofs, locked: !isLocked(dofs) });
  }

  /**
   * Whether all of these degrees of freedom are locked.
   *
   * @param {number[]} dofs
   */
  function isLocked(dofs) {
    const locked = store.facts.state?.locked ?? [];
    return dofs.length > 0 && dofs.every((dof) => locked.includes(dof));
  }

  /** Hold the joint in place while others are dragged, or release it. */
  function toggleHold() {
    const { overlay, state } = store.facts;
    const { point } = joint();
    const isHeld = overlay?.handles.some((one) => one.person === state?.person && one.point === point && one.held) ?? false;
    if (point) edit({ action: "hold", point, held: !isHeld });
  }

  /** Release all held joints of the active person on the frame. */
  const releaseAll = () => edit({ action: "hold", point: null, held: false });

  /** Fields of every edit: the active person and the frame that is shown. */
  function head() {
    const { shown, state } = store.facts;
    return { type: /** @type {const} */ ("pose"), frame: shown?.frame ?? state?.frame ?? 0, person: state?.person ?? 0 };
  }

  /** @param {Change<PoseEdit>} change */
  function edit(change) {
    if (!store.facts.connected) return;
    flush();
    send(/** @type {PoseEdit} */ ({ ...head(), ...change }));
  }

  /**
   * Merge a step with waiting steps of the same target, since a held key repeats faster than poses can be drawn.
   *
   * @param {string} what
   * @param {PoseEdit & {action: "nudge" | "turn" | "set"}} step
   */
  function gather(what, step) {
    if (!store.facts.connected) return;
    const key = `${step.frame} ${step.person} ${what}`;
    const waits = waiting.get(key);
    if (waits?.action === "nudge" && step.action === "nudge") {
      waits.right += step.right;
      waits.up += step.up;
    } else if (waits?.action === "turn" && step.action === "turn") {
      waits.by = (step.drag == null ? (waits.by ?? 0) : 0) + (step.by ?? 0);
    } else if (waits?.action === "set" && step.action === "set") {
      waits.value = step.value;
    } else {
      if (waiting.size === 0) setTimeout(flush, sentAt + SEND_MS - performance.now());
      waiting.set(key, step);
    }
  }

  function flush() {
    if (waiting.size === 0) return;
    sentAt = performance.now();
    for (const step of waiting.values()) send(step);
    waiting.clear();
  }

  /** Keep the selected degree of freedom among those of the joint. */
  function keepDof() {
    const { dofs } = joint();
    const { dof } = store.facts;
    if (dof === null || !dofs.includes(dof)) {
      const first = dofs[0] ?? null;
      if (first !== dof) store.set({ dof: first });
    }
  }

  return {
    steps, setSteps, joint, toJoint, selectPoint, selectDof, nextDof, nudge, turn, turnDofs, set, slide, mirror, takeAlternative,
    resetLimb, copyFrom, copyPerson, copyNextPerson, copyNeighbour, toggleLock, isLocked, toggleHold, releaseAll,
  }; // prettier-ignore
}

/** @returns {Steps} */
function restoredSteps() {
  const found = stored(STEPS_KEY);
  const good = (/** @type {"cm" | "deg"} */ unit) => (found?.[unit] > 0 ? Number(found[unit]) : DEFAULT_STEPS[unit]);
  return { cm: good("cm"), deg: good("deg") };
}
