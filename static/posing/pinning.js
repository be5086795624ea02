/**
 * Pointer gestures on pins: a click sets a pin, a drag of its head moves it, a right click removes it. Pins get pointer
 * events before joints and views, and stop those that they handle.
 */

import { scopePerson } from "../model/selectors.js";
import { GRAB_RADIUS } from "../panes/joint_picking.js";
import { HEAD_REACH, POINT_REACH, isSame, placedPins } from "../panes/pin_drawing.js";

const DRAG_THRESHOLD = 3;
/** Maximum time that a released pin waits for the program's overlay. */
const RESPONSE_MS = 600;

/**
 * @typedef {import("../panes/pane.js").Pane} Pane
 * @typedef {{pane: Pane, frame: number, pointer: number, start: {x: number, y: number}, offset: {u: number, v: number},
 *   pin: import("../model/protocol.js").PinMark, begun: boolean}} Held
 */

export class Pinning {
  #store;
  #send;
  #say;
  /** @type {Held | null} */
  #held = null;
  #moveScheduled = false;

  /**
   * @param {import("../model/store.js").Store} store
   * @param {(message: import("../model/protocol.js").ClientMessage) => void} send
   * @param {(text: string) => void} say
   */
  constructor(store, send, say) {
    this.#store = store;
    this.#send = send;
    this.#say = say;
    store.on(["connected"], () => this.#release(false));
    store.on(["overlay"], () => !this.#held && store.facts.heldPin && store.set({ heldPin: null }));
    store.on(["state"], () => store.facts.pinning && !store.facts.state?.point && store.set({ pinning: false }));
  }

  /** Toggle the mode in which each click pins the selected joint. */
  toggle() {
    const { pinning, state } = this.#store.facts;
    if (!pinning && !state?.point) this.#say("Select a joint first: click it in a view.");
    else this.#store.set({ pinning: !pinning, pinHover: null, hover: null, hoverPart: null });
  }

  toggleLive() {
    this.#store.set({ livePins: !this.#store.facts.livePins });
  }

  /** Revert the drag of a pin, or else end pin mode. Returns whether there was anything to cancel. */
  cancel() {
    if (this.#held) {
      if (this.#held.begun) this.#message("cancel", this.#held.pin);
      this.#release(false);
      return true;
    }
    const wasOn = this.#store.facts.pinning;
    if (wasOn) this.#store.set({ pinning: false });
    return wasOn;
  }

  /** Remove the pin under the pointer, or else the pins of the selected joint. */
  remove() {
    const { pinHover, state, overlay } = this.#store.facts;
    if (pinHover) this.#unpin(pinHover.person, pinHover.point, pinHover.camera);
    else if (state?.point && overlay?.pins.some((p) => p.person === state.person && p.point === state.point)) {
      this.#unpin(state.person, state.point, null);
    } else this.#say("No pin to remove. Point at a pin, or select a joint that has pins.");
  }

  /** Remove all pins of the active person on this frame. */
  clear() {
    const { state, overlay } = this.#store.facts;
    if (!state) return;
    if (overlay?.pins.some((p) => p.person === state.person)) this.#unpin(state.person, null, null);
    else this.#say("This person has no pins on this frame.");
  }

  /**
   * Fit all placed people, or only the active person, to pins and edges.
   *
   * @param {number | null} person null for all placed people
   */
  fit(person = scopePerson(this.#store.facts)) {
    const { state } = this.#store.facts;
    if (state) this.#send({ type: "fit", frame: state.frame, person });
  }

  /** Display name of the limb of the selected joint; null where no joint of a limb is selected. */
  get limb() {
    const { state, session } = this.#store.facts;
    const person = state && session?.people[state.person];
    const limb = state?.point ? person?.point_limbs[state.point] : undefined;
    return limb && limb.dofs.length > 0 && state?.point !== person?.points[0] ? limb.name : null;
  }

  /** Fit only the limb of the selected joint to pins and edges. */
  fitLimb() {
    const { state } = this.#store.facts;
    if (state && this.limb !== null) this.#send({ type: "fit", frame: state.frame, person: state.person, point: state.point });
    else this.#say("Select a joint of the limb first: click it in a view.");
  }

  /** Put the limb back that the last fit moved farthest although nobody had touched it. */
  takeLimbBack() {
    const { state } = this.#store.facts;
    if (state) this.#send({ type: "limb_back", frame: state.frame });
  }

  /**
   * Handle the pointer in a pane.
   *
   * @param {Pane} pane
   * @param {number} camera
   */
  watch(pane, camera) {
    const { surface } = pane;
    surface.addEventListener("pointerdown", (event) => this.#down(event, pane, camera));
    surface.addEventListener("pointermove", (event) => this.#move(event, pane, camera));
    surface.addEventListener("pointerup", (event) => this.#up(event));
    surface.addEventListener("pointercancel", () => this.#held && this.cancel());
    surface.addEventListener("pointerleave", () => this.#store.facts.pinHover && this.#store.set({ pinHover: null }));
    surface.addEventListener("contextmenu", (event) => event.preventDefault());
    surface.addEventListener("dblclick", (event) => {
      // A double-click that sets two pins must not fill the grid.
      if (this.#store.facts.pinning || this.#store.facts.pinHover || event.ctrlKey) event.stopImmediatePropagation();
    });
  }

  /**
   * The pin under the pointer: by its head, or by its point if no joint is nearer.
   *
   * @param {Pane} pane
   * @param {number} camera
   * @param {{x: number, y: number}} at
   */
  #hit(pane, camera, at) {
    const { facts } = this.#store;
    let nearest = null;
    let reach = HEAD_REACH;
    for (const one of placedPins(facts, pane.view, camera)) {
      const distance = Math.hypot(one.headX - at.x, one.headY - at.y);
      if (distance < reach) [nearest, reach] = [one, distance];
    }
    if (nearest || this.#joint(pane, at)) return nearest?.pin ?? null;
    return placedPins(facts, pane.view, camera).find(({ x, y }) => Math.hypot(x - at.x, y - at.y) < POINT_REACH)?.pin ?? null;
  }

  /**
   * The joint under the pointer.
   *
   * @param {Pane} pane
   * @param {{x: number, y: number}} at
   */
  #joint(pane, at) {
    if (!this.#store.facts.layers.shown.joints) return null;
    const from = (/** @type {{x: number, y: number}} */ { x, y }) => Math.hypot(x - at.x, y - at.y);
    const [nearest] = pane.graspableHandles().sort((a, b) => from(a) - from(b));
    return nearest && from(nearest) <= GRAB_RADIUS ? nearest.handle : null;
  }

  /**
   * @param {PointerEvent} event
   * @param {Pane} pane
   * @param {number} camera
   */
  #down(event, pane, camera) {
    const { pinning, pressed, state, shown } = this.#store.facts;
    if (this.#held || event.button === 1 || !state || !shown) return;
    const at = pane.locate(event);
    const hit = this.#hit(pane, camera, at);
    const isSetting = event.button === 0 && (pinning || event.ctrlKey || event.metaKey);
    if (!hit && !isSetting) return;
    event.stopImmediatePropagation();
    if (!this.#store.isSettled) return;
    if (event.button === 2 && hit) {
      this.#unpin(hit.person, hit.point, camera);
      this.#store.set({ pinHover: null });
      return;
    }
    if (event.button !== 0) return;
    const { person, point } = pressed?.state === state ? pressed : state;
    const joint = point === null ? this.#joint(pane, at) : { person, point };
    if (!hit && !joint) {
      this.#say("Select a joint first: click it in a view, then Ctrl+click to pin it.");
      return;
    }
    // Among crowded joints, a click refers to the selected joint, even if another joint's pin is nearer.
    const isOwn = hit && (!isSetting || (hit.person === joint?.person && hit.point === joint.point));
    const pointer = pane.view.toImage(at.x, at.y);
    const model = { model_u: null, model_v: null };
    const pin = isOwn || !joint ? /** @type {NonNullable<typeof hit>} */ (hit) : { camera, ...joint, ...pointer, ...model };
    const offset = { u: pin.u - pointer.u, v: pin.v - pointer.v };
    pane.surface.setPointerCapture(event.pointerId);
    pane.surface.classList.add("is-dragging");
    this.#held = { pane, frame: shown.frame, pointer: event.pointerId, start: at, offset, pin, begun: false };
    this.#store.set({ dragging: true, hover: null, hoverPart: null, heldPin: pin });
    if (isOwn) this.#send({ type: "select", person: pin.person, point: pin.point });
    else this.#begin(this.#held);
  }

  /** @param {Held} held */
  #begin(held) {
    held.begun = true;
    this.#message("start", held.pin);
  }

  /**
   * @param {PointerEvent} event
   * @param {Pane} pane
   * @param {number} camera
   */
  #move(event, pane, camera) {
    const held = this.#held;
    if (!held) {
      if (event.buttons === 0) this.#hover(event, pane, camera);
      return;
    }
    event.stopImmediatePropagation();
    if (event.pointerId !== held.pointer) return;
    const at = held.pane.locate(event);
    const isFar = Math.hypot(at.x - held.start.x, at.y - held.start.y) >= DRAG_THRESHOLD;
    // Small movements during a click do not move the pin.
    if (!isFar && held.start.x !== Infinity) return;
    held.start = { x: Infinity, y: Infinity };
    if (!held.begun) this.#begin(held);
    const { u, v } = held.pane.view.toImage(at.x, at.y);
    held.pin = { ...held.pin, ...this.#within(held.pin.camera, u + held.offset.u, v + held.offset.v) };
    this.#store.set({ heldPin: { ...held.pin, model_u: null, model_v: null } });
    if (this.#moveScheduled) return;
    this.#moveScheduled = true;
    requestAnimationFrame(() => {
      this.#moveScheduled = false;
      if (this.#held === held) this.#message("move", held.pin);
    });
  }

  /** @param {PointerEvent} event */
  #up(event) {
    if (!this.#held) return;
    event.stopImmediatePropagation();
    if (event.pointerId !== this.#held.pointer) return;
    if (this.#held.begun) this.#message("end", this.#held.pin);
    this.#release(this.#held.begun);
  }

  /**
   * @param {PointerEvent} event
   * @param {Pane} pane
   * @param {number} camera
   */
  #hover(event, pane, camera) {
    const { facts } = this.#store;
    const hit = this.#hit(pane, camera, pane.locate(event));
    const previous = facts.pinHover;
    if (hit ? !isSame(hit, previous) : previous) {
      this.#store.set({ pinHover: hit && { camera, person: hit.person, point: hit.point } });
    }
    pane.surface.classList.toggle("is-over-pin", hit !== null);
    if (!hit && !facts.pinning) return;
    event.stopImmediatePropagation();
    pane.surface.classList.remove("is-over-joint", "is-over-part");
    if (facts.hover || facts.hoverPart) this.#store.set({ hover: null, hoverPart: null });
  }

  /**
   * Clamp a position to the image.
   *
   * @param {number} camera
   * @param {number} u
   * @param {number} v
   */
  #within(camera, u, v) {
    const { width, height } = this.#store.facts.session?.cameras[camera] ?? { width: 0, height: 0 };
    return { u: Math.max(-0.5, Math.min(width - 0.5, u)), v: Math.max(-0.5, Math.min(height - 0.5, v)) };
  }

  /**
   * @param {"start" | "move" | "end" | "cancel"} phase
   * @param {import("../model/protocol.js").PinMark} pin
   */
  #message(phase, { camera, person, point, u, v }) {
    const { frame } = /** @type {Held} */ (this.#held);
    this.#send({ type: "pin", phase, frame, camera, person, point, u, v, live: this.#store.facts.livePins });
  }

  /**
   * @param {number} person
   * @param {string | null} point
   * @param {number | null} camera
   */
  #unpin(person, point, camera) {
    const { state } = this.#store.facts;
    if (state) this.#send({ type: "unpin", frame: state.frame, person, point, camera });
  }

  /** @param {boolean} isKept whether to show the pin at its last position until the program's overlay arrives */
  #release(isKept) {
    const held = this.#held;
    if (!held) return;
    this.#held = null;
    held.pane.surface.classList.remove("is-dragging");
    this.#store.set({ dragging: false, ...(isKept ? {} : { heldPin: null }) });
    setTimeout(() => !this.#held && this.#store.facts.heldPin && this.#store.set({ heldPin: null }), RESPONSE_MS);
  }
}
