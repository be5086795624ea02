/**
 * Edits of the chosen curves: drags and steps of their values on a frame, which becomes a keyframe, and shifts and smoothing
 * of the marked range. Values stop at the joint limits, and locked ones stay.
 */

import { isAllowed } from "../model/unavailable_reasons.js";

const STORED_HIDDEN = "quadrille.curves-hidden";

/**
 * @typedef {import("../model/store.js").Facts["range"]} Range
 * @typedef {{drag: number, frame: number, dofs: number[], range: Range, by: number}} Drag
 */

export class CurveEdits {
  #store;
  #posing;
  #send;
  /** Names of the curves that are switched off. */
  hidden = new Set(/** @type {string[]} */ (JSON.parse(localStorage.getItem(STORED_HIDDEN) ?? "[]")));
  /** @type {number[]} */
  #chosen = [];
  /** @type {Drag | null} */
  #drag = null;

  /**
   * @param {import("../model/store.js").Store} store
   * @param {import("./posing.js").Posing} posing
   * @param {(message: import("../model/protocol.js").ClientMessage) => void} send
   */
  constructor(store, posing, send) {
    this.#store = store;
    this.#posing = posing;
    this.#send = send;
    store.on(["connected"], () => this.end());
  }

  /** The drag that is in progress. */
  get drag() {
    return this.#drag;
  }

  /** Whether the page may edit poses. */
  get isOffered() {
    const { connected, session } = this.#store.facts;
    return connected && session !== null && isAllowed({ type: "pose", action: "mirror", frame: 0, person: 0 }, session);
  }

  /** Show or hide the curves of a name. @param {string} label */
  toggleHidden(label) {
    if (!this.hidden.delete(label)) this.hidden.add(label);
    localStorage.setItem(STORED_HIDDEN, JSON.stringify([...this.hidden]));
    this.#set(this.#chosen);
  }

  /** Degrees of freedom whose curves can be chosen: those that are drawn and not locked. */
  get choices() {
    const { curves, drawer, state } = this.#store.facts;
    if (!this.isOffered || curves?.group !== drawer || curves?.person !== state?.person) return [];
    return (curves?.series ?? []).flatMap(({ dof, label }) => (dof === null || this.hidden.has(label) || this.#posing.isLocked([dof]) ? [] : [dof]));
  }

  /** The chosen degrees of freedom, the one chosen last at the end. */
  get chosen() {
    const { choices } = this;
    return this.#chosen.filter((dof) => choices.includes(dof));
  }

  /** Unit of the curve that was chosen last; drags, steps and shifts concern the chosen ones of this unit. */
  get unit() {
    return this.#unit(this.chosen.at(-1) ?? -1);
  }

  /**
   * A value as the drag of the range moves it, within the limits.
   *
   * @param {number | null} dof
   * @param {number} frame
   * @param {number} value
   */
  moved(dof, frame, value) {
    const { range, dofs, by } = this.#drag ?? {};
    if (dof === null || !range || !dofs?.includes(dof) || frame < range.first || frame > range.last) return value;
    const { low, high } = this.#posing.person?.dofs[dof] ?? {};
    return Math.max(low ?? -Infinity, Math.min(high ?? Infinity, value + (by ?? 0)));
  }

  /** Why the chosen curves cannot be edited; null if they can. */
  why = () => (this.chosen.length > 0 ? null : "No curve is chosen. Open the curves, then click a point of a curve of an angle.");

  /** Why no range of the chosen curves can be edited; null if one can. */
  whyNoRange = () => this.why() ?? (this.#store.facts.range ? null : "No range is marked. Press [ and ] to mark its ends.");

  /**
   * Choose a curve.
   *
   * @param {number} dof
   * @param {boolean} toggles whether the others stay chosen, and the curve is left out if it is chosen
   */
  choose(dof, toggles) {
    const others = this.chosen.filter((one) => one !== dof);
    if (toggles) this.#set(others.length < this.chosen.length ? others : [...others, dof]);
    else this.#set(this.chosen.includes(dof) ? [...others, dof] : [dof]);
  }

  /**
   * Choose the next curve.
   *
   * @param {boolean} adds whether the others stay chosen
   */
  next(adds) {
    const { choices, chosen } = this;
    const free = adds ? choices.filter((dof) => !chosen.includes(dof)) : choices;
    const at = choices.indexOf(chosen.at(-1) ?? -1);
    const dof = free.find((one) => choices.indexOf(one) > at) ?? free[0];
    if (dof !== undefined) this.#set(adds ? [...chosen, dof] : [dof]);
  }

  /**
   * Begin to drag the chosen curves.
   *
   * @param {number} frame
   * @param {Range} range the marked range if all of it is dragged
   */
  begin(frame, range) {
    this.#drag = { drag: Math.floor(Math.random() * 2 ** 31), frame, dofs: this.#alike, range, by: 0 };
    this.#store.set({ dragging: true });
  }

  /** @param {number} by degrees or centimetres from the start of the drag */
  move(by) {
    if (!this.#drag) return;
    const { drag, frame, dofs, range } = this.#drag;
    this.#drag.by = by;
    if (!range) this.#posing.turnDofs(dofs, by, { drag, frame });
  }

  /** End the drag. The poses of a range change now, those of a frame have followed it. */
  end() {
    const { range = null, dofs = [], by = 0 } = this.#drag ?? {};
    this.#release();
    if (range && by !== 0) this.editRange("shift", by, range, dofs);
  }

  /** Take the drag back. */
  cancel() {
    const { drag, frame, dofs, range, by } = this.#drag ?? {};
    this.#release();
    if (drag !== undefined && frame !== undefined && dofs && !range && by !== 0) this.#posing.turnDofs(dofs, null, { drag, frame });
  }

  /**
   * Change the values on the shown frame by a multiple of the step of the joint bar.
   *
   * @param {number} factor
   */
  step(factor) {
    if (!this.why()) this.#posing.turnDofs(this.#alike, factor * this.#posing.steps[this.unit]);
  }

  /**
   * @param {"smooth" | "shift"} action
   * @param {number} amount cutoff in hertz, or degrees or centimetres
   * @param {Range} [range]
   * @param {number[]} [dofs]
   */
  editRange(action, amount, range = this.#store.facts.range, dofs = action === "smooth" ? this.chosen : this.#alike) {
    const person = this.#store.facts.state?.person;
    if (range && dofs.length && person !== undefined) this.#send({ type: "range", action, ...range, person, dofs, amount });
  }

  /** The chosen degrees of freedom of one unit. */
  get #alike() {
    return this.chosen.filter((dof) => this.#unit(dof) === this.unit);
  }

  /** @param {number} dof */
  #unit(dof) {
    return this.#posing.person?.dofs[dof]?.unit ?? "deg";
  }

  /** @param {number[]} dofs */
  #set(dofs) {
    this.#chosen = dofs;
    this.#store.set({ curves: this.#store.facts.curves });
  }

  #release() {
    if (!this.#drag) return;
    this.#drag = null;
    this.#store.set({ dragging: false, curves: this.#store.facts.curves });
  }
}
