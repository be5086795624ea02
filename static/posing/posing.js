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
 */

export class Posing {
  #store;
  #send;
  #steps = restoredSteps();
  /** @type {Map<string, import("../model/protocol.js").PoseEdit>} steps that wait to be sent, by target */
  #waiting = new Map();
  #sentAt = -Infinity;
  /** @type {{point: string, at: number} | null} the joint requested last, until the program has confirmed it */
  #requested = null;

  /**
   * @param {import("../model/store.js").Store} store
   * @param {(message: import("../model/protocol.js").ClientMessage) => void} send
   */
  constructor(store, send) {
    this.#store = store;
    this.#send = send;
    store.subscribe((changed) => {
      if (this.#requested?.point === store.facts.state?.point) this.#requested = null;
      if (changed.has("state") || changed.has("session")) this.#keepDof();
    });
  }

  /** Step sizes of the keys. */
  get steps() {
    return this.#steps;
  }

  /** @param {Partial<Steps>} steps */
  setSteps(steps) {
    this.#steps = { ...this.#steps, ...steps };
    localStorage.setItem(STEPS_KEY, JSON.stringify(this.#steps));
  }

  /** The active person; null before the session is known. */
  get person() {
    const { session, state } = this.#store.facts;
    return (state && session?.people[state.person]) ?? null;
  }

  /** The selected joint; null if there is none. */
  get selected() {
    // Keys are faster than the program's answers. A request without an answer expires.
    const requested = this.#requested && performance.now() < this.#requested.at + REQUEST_MS ? this.#requested.point : null;
    return requested ?? this.#store.facts.state?.point ?? null;
  }

  /** The joint to edit: the selected joint, or else the root. */
  get point() {
    return this.selected ?? this.person?.points[0] ?? null;
  }

  /** Indices of the joint's degrees of freedom. */
  get dofs() {
    const { person, point } = this;
    return (person && point && person.point_dofs[point]) || [];
  }

  /** Name and degrees of freedom of the joint's limb. */
  get limb() {
    const { person, point } = this;
    return (person && point && person.point_limbs[point]) || { name: "", dofs: [] };
  }

  /**
   * Select the next or the previous joint.
   *
   * @param {1 | -1} way
   */
  toJoint(way) {
    const { person, selected } = this;
    if (!person) return;
    const points = person.points;
    const at = selected === null ? (way > 0 ? -1 : 0) : points.indexOf(selected);
    this.selectPoint(points[(at + way + points.length) % points.length]);
  }

  /** @param {string} point */
  selectPoint(point) {
    const { state } = this.#store.facts;
    if (!state) return;
    this.#requested = { point, at: performance.now() };
    this.#store.set({ state });
    this.#send({ type: "select", person: state.person, point });
  }

  /** @param {number} dof */
  selectDof(dof) {
    if (dof !== this.#store.facts.dof) this.#store.set({ dof });
  }

  /** Select the next degree of freedom of the joint. */
  nextDof() {
    const { dofs } = this;
    if (dofs.length) this.selectDof(dofs[(dofs.indexOf(this.#store.facts.dof ?? -1) + 1) % dofs.length]);
  }

  /**
   * Move the joint parallel to the image plane of the active view, by a multiple of the step.
   *
   * @param {Way} way
   * @param {number} factor
   */
  nudge(way, factor) {
    const { state, active, filled } = this.#store.facts;
    if (!state) return;
    const camera = filled ?? active ?? 0;
    const [right, up] = [way.right * factor * this.#steps.cm, way.up * factor * this.#steps.cm];
    const point = this.selected;
    this.#gather(`nudge ${camera} ${point}`, { ...this.#head(), action: "nudge", point, camera, right, up });
  }

  /**
   * Change the selected degree of freedom by a multiple of the step.
   *
   * @param {number} factor
   */
  turn(factor) {
    const { dof } = this.#store.facts;
    const info = dof === null ? undefined : this.person?.dofs[dof];
    if (dof === null || !info) return;
    this.turnDofs([dof], factor * this.#steps[info.unit]);
  }

  /**
   * Step degrees of freedom by a number of degrees or centimetres.
   *
   * @param {number[]} dofs
   * @param {number | null} by null takes the drag back
   * @param {{drag: number, frame: number} | null} drag its number and frame, from whose start the step counts
   */
  turnDofs(dofs, by, drag = null) {
    const step = { ...this.#head(), ...drag, action: /** @type {const} */ ("turn"), dofs, by };
    if (by === null) this.#edit(step);
    else this.#gather(`turn ${dofs} ${drag?.drag}`, step);
  }

  /**
   * @param {number} dof
   * @param {number} value in degrees or centimetres
   */
  set(dof, value) {
    this.#edit({ ...this.#head(), action: "set", dof, value });
  }

  /**
   * Set a value repeatedly, as a slider does. Only the newest waiting value is sent.
   *
   * @param {number} dof
   * @param {number} value in degrees or centimetres
   */
  slide(dof, value) {
    this.#gather(`set ${dof}`, { ...this.#head(), action: "set", dof, value });
  }

  mirror() {
    this.#edit({ ...this.#head(), action: "mirror" });
  }

  /**
   * Switch to the best alternative pose, or back.
   *
   * @param {number} [rank] of another one among those of the reason
   */
  takeAlternative(rank) {
    this.#edit({ ...this.#head(), action: "alternative", rank: rank ?? null });
  }

  resetLimb() {
    this.#edit({ ...this.#head(), action: "reset", point: this.selected });
  }

  /** @param {number} from */
  copyFrom(from) {
    this.#edit({ ...this.#head(), action: "copy", from });
  }

  /**
   * Copy the joint angles of another person on this frame; position and orientation stay.
   *
   * @param {number} from
   */
  copyPerson(from) {
    if (from !== this.#head().person) this.#edit({ ...this.#head(), action: "copy_person", from });
  }

  /** Copy the joint angles of the next person in the list. */
  copyNextPerson() {
    const count = this.#store.facts.session?.people.length ?? 1;
    this.copyPerson((this.#head().person + 1) % count);
  }

  /** @param {1 | -1} way */
  copyNeighbour(way) {
    const { frame } = this.#head();
    const from = frame + way;
    if (from >= 0 && from < (this.#store.facts.session?.n_frames ?? 0)) this.copyFrom(from);
  }

  /**
   * Lock degrees of freedom, or unlock them if all are locked.
   *
   * @param {number[]} dofs
   */
  toggleLock(dofs) {
    if (dofs.length) this.#edit({ ...this.#head(), action: "lock", dofs, locked: !this.isLocked(dofs) });
  }

  /**
   * Whether all of these degrees of freedom are locked.
   *
   * @param {number[]} dofs
   */
  isLocked(dofs) {
    const locked = this.#store.facts.state?.locked ?? [];
    return dofs.length > 0 && dofs.every((dof) => locked.includes(dof));
  }

  /** Hold the joint in place while others are dragged, or release it. */
  toggleHold() {
    const { point } = this;
    if (point) this.#edit({ ...this.#head(), action: "hold", point, held: !this.#isHeld(point) });
  }

  /** Release all held joints of the active person on the frame. */
  releaseAll() {
    this.#edit({ ...this.#head(), action: "hold", point: null, held: false });
  }

  /** @param {string} point */
  #isHeld(point) {
    const { overlay, state } = this.#store.facts;
    return overlay?.handles.some((one) => one.person === state?.person && one.point === point && one.held) ?? false;
  }

  /** Fields of every edit: the active person and the frame that is shown. */
  #head() {
    const { shown, state } = this.#store.facts;
    return { type: /** @type {const} */ ("pose"), frame: shown?.frame ?? state?.frame ?? 0, person: state?.person ?? 0 };
  }

  /** @param {import("../model/protocol.js").PoseEdit} edit */
  #edit(edit) {
    if (!this.#store.facts.connected) return;
    this.#flush();
    this.#send(edit);
  }

  /**
   * Merge a step with waiting steps of the same target, since a held key repeats faster than poses can be drawn.
   *
   * @param {string} what
   * @param {import("../model/protocol.js").PoseEdit & {action: "nudge" | "turn" | "set"}} step
   */
  #gather(what, step) {
    if (!this.#store.facts.connected) return;
    const key = `${step.frame} ${step.person} ${what}`;
    const waits = this.#waiting.get(key);
    if (waits?.action === "nudge" && step.action === "nudge") {
      waits.right += step.right;
      waits.up += step.up;
    } else if (waits?.action === "turn" && step.action === "turn") {
      waits.by = (step.drag == null ? (waits.by ?? 0) : 0) + (step.by ?? 0);
    } else if (waits?.action === "set" && step.action === "set") {
      waits.value = step.value;
    } else {
      if (this.#waiting.size === 0) setTimeout(() => this.#flush(), this.#sentAt + SEND_MS - performance.now());
      this.#waiting.set(key, step);
    }
  }

  #flush() {
    if (this.#waiting.size === 0) return;
    this.#sentAt = performance.now();
    for (const step of this.#waiting.values()) this.#send(step);
    this.#waiting.clear();
  }

  /** Keep the selected degree of freedom among those of the joint. */
  #keepDof() {
    const { dofs } = this;
    const { dof } = this.#store.facts;
    if (dof === null || !dofs.includes(dof)) {
      const first = dofs[0] ?? null;
      if (first !== dof) this.#store.set({ dof: first });
    }
  }
}

/** @returns {Steps} */
function restoredSteps() {
  const found = stored(STEPS_KEY);
  const good = (/** @type {"cm" | "deg"} */ unit) => (found?.[unit] > 0 ? Number(found[unit]) : DEFAULT_STEPS[unit]);
  return { cm: good("cm"), deg: good("deg") };
}
