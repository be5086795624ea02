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

/** @typedef {ReturnType<typeof makeCurveEdits>} CurveEdits */

/**
 * @param {import("../model/store.js").Store} store
 * @param {import("./posing.js").Posing} posing
 * @param {(message: import("../model/protocol.js").ClientMessage) => void} send
 */
export function makeCurveEdits(store, posing, send) {
  /** Names of the curves that are switched off. */
  const hidden = new Set(/** @type {string[]} */ (JSON.parse(localStorage.getItem(STORED_HIDDEN) ?? "[]")));
  /** @type {number[]} */
  let picked = [];
  /** @type {Drag | null} */
  let drag = null;

  store.on(["connected"], end);

  /** Show or hide the curves of a name. @param {string} label */
  function toggleHidden(label) {
    if (!hidden.delete(label)) hidden.add(label);
    localStorage.setItem(STORED_HIDDEN, JSON.stringify([...hidden]));
    pick(picked);
  }

  /** Degrees of freedom whose curves can be chosen: those that are drawn and not locked. */
  function choices() {
    const { curves, drawer, state, connected, session } = store.facts;
    const isOffered = connected && session && isAllowed({ type: "pose", action: "mirror", frame: 0, person: 0 }, session);
    if (!isOffered || curves?.group !== drawer || curves?.person !== state?.person) return [];
    return (curves?.series ?? []).flatMap(({ dof, label }) => (dof === null || hidden.has(label) || posing.isLocked([dof]) ? [] : [dof]));
  }

  /** The chosen degrees of freedom, the one chosen last at the end. */
  function chosen() {
    const all = choices();
    return picked.filter((dof) => all.includes(dof));
  }

  /** Unit of the curve that was chosen last; drags, steps and shifts concern the chosen ones of this unit. */
  const unit = () => unitOf(chosen().at(-1) ?? -1);

  /**
   * A value as the drag of the range moves it, within the limits.
   *
   * @param {number | null} dof
   * @param {number} frame
   * @param {number} value
   */
  function moved(dof, frame, value) {
    const { range, dofs, by } = drag ?? {};
    if (dof === null || !range || !dofs?.includes(dof) || frame < range.first || frame > range.last) return value;
    const { low, high } = posing.joint().person?.dofs[dof] ?? {};
    return Math.max(low ?? -Infinity, Math.min(high ?? Infinity, value + (by ?? 0)));
  }

  /** Why the chosen curves cannot be edited; null if they can. */
  const why = () => (chosen().length > 0 ? null : "No curve is chosen. Open the curves, then click a point of a curve of an angle.");

  /** Why no range of the chosen curves can be edited; null if one can. */
  const whyNoRange = () => why() ?? (store.facts.range ? null : "No range is marked. Press [ and ] to mark its ends.");

  /**
   * Choose a curve.
   *
   * @param {number} dof
   * @param {boolean} toggles whether the others stay chosen, and the curve is left out if it is chosen
   */
  function choose(dof, toggles) {
    const others = chosen().filter((one) => one !== dof);
    const isChosen = others.length < chosen().length;
    if (toggles) pick(isChosen ? others : [...others, dof]);
    else pick(isChosen ? [...others, dof] : [dof]);
  }

  /**
   * Choose the next curve.
   *
   * @param {boolean} adds whether the others stay chosen
   */
  function next(adds) {
    const [all, own] = [choices(), chosen()];
    const free = adds ? all.filter((dof) => !own.includes(dof)) : all;
    const at = all.indexOf(own.at(-1) ?? -1);
    const dof = free.find((one) => all.indexOf(one) > at) ?? free[0];
    if (dof !== undefined) pick(adds ? [...own, dof] : [dof]);
  }

  /**
   * Begin to drag the chosen curves.
   *
   * @param {number} frame
   * @param {Range} range the marked range if all of it is dragged
   */
  function begin(frame, range) {
    drag = { drag: Math.floor(Math.random() * 2 ** 31), frame, dofs: alike(), range, by: 0 };
    store.set({ dragging: true });
  }

  /** @param {number} by degrees or centimetres from the start of the drag */
  function move(by) {
    if (!drag) return;
    drag.by = by;
    if (!drag.range) posing.turnDofs(drag.dofs, by, drag);
  }

  /** End the drag. The poses of a range change now, those of a frame have followed it. */
  function end() {
    const ended = release();
    if (ended?.range && ended.by !== 0) editRange("shift", ended.by, ended.range, ended.dofs);
  }

  /** Take the drag back. */
  function cancel() {
    const ended = release();
    if (ended && !ended.range && ended.by !== 0) posing.turnDofs(ended.dofs, null, ended);
  }

  /**
   * Change the values on the shown frame by a multiple of the step of the joint bar.
   *
   * @param {number} factor
   */
  function step(factor) {
    if (!why()) posing.turnDofs(alike(), factor * posing.steps[unit()]);
  }

  /**
   * @param {"smooth" | "shift"} action
   * @param {number} amount cutoff in hertz, or degrees or centimetres
   * @param {Range} [range]
   * @param {number[]} [dofs]
   */
  function editRange(action, amount, range = store.facts.range, dofs = action === "smooth" ? chosen() : alike()) {
    const person = store.facts.state?.person;
    if (range && dofs.length && person !== undefined) send({ type: "range", action, ...range, person, dofs, amount });
  }

  /** The chosen degrees of freedom of one unit. */
  const alike = () => chosen().filter((dof) => unitOf(dof) === unit());

  /** @param {number} dof */
  const unitOf = (dof) => posing.joint().person?.dofs[dof]?.unit ?? "deg";

  /** @param {number[]} dofs */
  function pick(dofs) {
    picked = dofs;
    store.set({ curves: store.facts.curves });
  }

  /** Returns the drag that was in progress. */
  function release() {
    const ended = drag;
    drag = null;
    if (ended) store.set({ dragging: false, curves: store.facts.curves });
    return ended;
  }

  /** The drag that is in progress. */
  const dragged = () => drag;
  return { hidden, toggleHidden, dragged, choices, chosen, unit, moved, why, whyNoRange, choose, next, begin, move, end, cancel, step, editRange };
}
