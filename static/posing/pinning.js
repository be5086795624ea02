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

/** @typedef {ReturnType<typeof makePinning>} Pinning */

/**
 * @param {import("../model/store.js").Store} store
 * @param {(message: import("../model/protocol.js").ClientMessage) => void} send
 * @param {(text: string) => void} say
 */
export function makePinning(store, send, say) {
  /** @type {Held | null} */
  let held = null;
  let moveScheduled = false;

  store.on(["connected"], () => release(false));
  store.on(["overlay"], () => !held && store.facts.heldPin && store.set({ heldPin: null }));
  store.on(["state"], () => store.facts.pinning && !store.facts.state?.point && store.set({ pinning: false }));

  /** Toggle the mode in which each click pins the selected joint. */
  function toggle() {
    const { pinning, state } = store.facts;
    if (!pinning && !state?.point) say("Select a joint first: click it in a view.");
    else store.set({ pinning: !pinning, pinHover: null, hover: null, hoverPart: null });
  }

  const toggleLive = () => store.set({ livePins: !store.facts.livePins });

  /** Revert the drag of a pin, or else end pin mode. Returns whether there was anything to cancel. */
  function cancel() {
    if (held) {
      if (held.begun) message("cancel", held.pin);
      release(false);
      return true;
    }
    const wasOn = store.facts.pinning;
    if (wasOn) store.set({ pinning: false });
    return wasOn;
  }

  /** Remove the pin under the pointer, or else the pins of the selected joint. */
  function remove() {
    const { pinHover, state, overlay } = store.facts;
    if (pinHover) unpin(pinHover.person, pinHover.point, pinHover.camera);
    else if (state?.point && overlay?.pins.some((p) => p.person === state.person && p.point === state.point)) {
      unpin(state.person, state.point, null);
    } else say("No pin to remove. Point at a pin, or select a joint that has pins.");
  }

  /** Remove all pins of the active person on this frame. */
  function clear() {
    const { state, overlay } = store.facts;
    if (!state) return;
    if (overlay?.pins.some((p) => p.person === state.person)) unpin(state.person, null, null);
    else say("This person has no pins on this frame.");
  }

  /**
   * Fit all placed people, or only the active person, to pins and edges.
   *
   * @param {number | null} person null for all placed people
   */
  function fit(person = scopePerson(store.facts)) {
    const { state } = store.facts;
    if (state) send({ type: "fit", frame: state.frame, person });
  }

  /** Display name of the limb of the selected joint; null where no joint of a limb is selected. */
  function limb() {
    const { state, session } = store.facts;
    const person = state && session?.people[state.person];
    const limb = state?.point ? person?.point_limbs[state.point] : undefined;
    return limb && limb.dofs.length > 0 && state?.point !== person?.points[0] ? limb.name : null;
  }

  /** Fit only the limb of the selected joint to pins and edges. */
  function fitLimb() {
    const { state } = store.facts;
    if (state && limb() !== null) send({ type: "fit", frame: state.frame, person: state.person, point: state.point });
    else say("Select a joint of the limb first: click it in a view.");
  }

  /** Put the limb back that the last fit moved farthest although nobody had touched it. */
  function takeLimbBack() {
    const { state } = store.facts;
    if (state) send({ type: "limb_back", frame: state.frame });
  }

  /**
   * Handle the pointer in a pane.
   *
   * @param {Pane} pane
   * @param {number} camera
   */
  function watch(pane, camera) {
    const { surface } = pane;
    surface.addEventListener("pointerdown", (event) => down(event, pane, camera));
    surface.addEventListener("pointermove", (event) => move(event, pane, camera));
    surface.addEventListener("pointerup", (event) => up(event));
    surface.addEventListener("pointercancel", () => held && cancel());
    surface.addEventListener("pointerleave", () => store.facts.pinHover && store.set({ pinHover: null }));
    surface.addEventListener("contextmenu", (event) => event.preventDefault());
    surface.addEventListener("dblclick", (event) => {
      // A double-click that sets two pins must not fill the grid.
      if (store.facts.pinning || store.facts.pinHover || event.ctrlKey) event.stopImmediatePropagation();
    });
  }

  /**
   * The pin under the pointer: by its head, or by its point if no joint is nearer.
   *
   * @param {Pane} pane
   * @param {number} camera
   * @param {{x: number, y: number}} at
   */
  function pinAt(pane, camera, at) {
    const pins = placedPins(store.facts, pane.view, camera);
    const from = (/** @type {typeof pins[number]} */ { headX, headY }) => Math.hypot(headX - at.x, headY - at.y);
    const [nearest] = pins.filter((one) => from(one) < HEAD_REACH).sort((a, b) => from(a) - from(b));
    if (nearest || jointAt(pane, at)) return nearest?.pin ?? null;
    return pins.find(({ x, y }) => Math.hypot(x - at.x, y - at.y) < POINT_REACH)?.pin ?? null;
  }

  /**
   * The joint under the pointer.
   *
   * @param {Pane} pane
   * @param {{x: number, y: number}} at
   */
  function jointAt(pane, at) {
    if (!store.facts.layers.shown.joints) return null;
    const from = (/** @type {{x: number, y: number}} */ { x, y }) => Math.hypot(x - at.x, y - at.y);
    const [nearest] = pane.graspableHandles().sort((a, b) => from(a) - from(b));
    return nearest && from(nearest) <= GRAB_RADIUS ? nearest.handle : null;
  }

  /**
   * @param {PointerEvent} event
   * @param {Pane} pane
   * @param {number} camera
   */
  function down(event, pane, camera) {
    const { pinning, pressed, state, shown } = store.facts;
    if (held || event.button === 1 || !state || !shown) return;
    const at = pane.locate(event);
    const hit = pinAt(pane, camera, at);
    const isSetting = event.button === 0 && (pinning || event.ctrlKey || event.metaKey);
    if (!hit && !isSetting) return;
    event.stopImmediatePropagation();
    if (!store.isSettled) return;
    if (event.button === 2 && hit) {
      unpin(hit.person, hit.point, camera);
      store.set({ pinHover: null });
      return;
    }
    if (event.button !== 0) return;
    const { person, point } = pressed?.state === state ? pressed : state;
    const joint = point === null ? jointAt(pane, at) : { person, point };
    if (!hit && !joint) return say("Select a joint first: click it in a view, then Ctrl+click to pin it.");
    // Among crowded joints, a click refers to the selected joint, even if another joint's pin is nearer.
    const isOwn = hit && (!isSetting || (hit.person === joint?.person && hit.point === joint.point));
    const pointer = pane.view.toImage(at.x, at.y);
    const model = { model_u: null, model_v: null };
    const pin = isOwn || !joint ? /** @type {NonNullable<typeof hit>} */ (hit) : { camera, ...joint, ...pointer, ...model };
    const offset = { u: pin.u - pointer.u, v: pin.v - pointer.v };
    pane.surface.setPointerCapture(event.pointerId);
    pane.surface.classList.add("is-dragging");
    held = { pane, frame: shown.frame, pointer: event.pointerId, start: at, offset, pin, begun: false };
    store.set({ dragging: true, hover: null, hoverPart: null, heldPin: pin });
    if (isOwn) send({ type: "select", person: pin.person, point: pin.point });
    else begin(held);
  }

  /** @param {Held} held */
  function begin(held) {
    held.begun = true;
    message("start", held.pin);
  }

  /**
   * @param {PointerEvent} event
   * @param {Pane} pane
   * @param {number} camera
   */
  function move(event, pane, camera) {
    const moved = held;
    if (!moved) return event.buttons === 0 && hover(event, pane, camera);
    event.stopImmediatePropagation();
    if (event.pointerId !== moved.pointer) return;
    const at = moved.pane.locate(event);
    const isFar = Math.hypot(at.x - moved.start.x, at.y - moved.start.y) >= DRAG_THRESHOLD;
    // Small movements during a click do not move the pin.
    if (!isFar && moved.start.x !== Infinity) return;
    moved.start = { x: Infinity, y: Infinity };
    if (!moved.begun) begin(moved);
    const { u, v } = moved.pane.view.toImage(at.x, at.y);
    moved.pin = { ...moved.pin, ...within(moved.pin.camera, u + moved.offset.u, v + moved.offset.v) };
    store.set({ heldPin: { ...moved.pin, model_u: null, model_v: null } });
    if (moveScheduled) return;
    moveScheduled = true;
    requestAnimationFrame(() => {
      moveScheduled = false;
      if (held === moved) message("move", moved.pin);
    });
  }

  /** @param {PointerEvent} event */
  function up(event) {
    if (!held) return;
    event.stopImmediatePropagation();
    if (event.pointerId !== held.pointer) return;
    if (held.begun) message("end", held.pin);
    release(held.begun);
  }

  /**
   * @param {PointerEvent} event
   * @param {Pane} pane
   * @param {number} camera
   */
  function hover(event, pane, camera) {
    const { facts } = store;
    const hit = pinAt(pane, camera, pane.locate(event));
    const previous = facts.pinHover;
    if (hit ? !isSame(hit, previous) : previous) {
      store.set({ pinHover: hit && { camera, person: hit.person, point: hit.point } });
    }
    pane.surface.classList.toggle("is-over-pin", hit !== null);
    if (!hit && !facts.pinning) return;
    event.stopImmediatePropagation();
    pane.surface.classList.remove("is-over-joint", "is-over-part");
    if (facts.hover || facts.hoverPart) store.set({ hover: null, hoverPart: null });
  }

  /**
   * Clamp a position to the image.
   *
   * @param {number} camera
   * @param {number} u
   * @param {number} v
   */
  function within(camera, u, v) {
    const { width, height } = store.facts.session?.cameras[camera] ?? { width: 0, height: 0 };
    return { u: Math.max(-0.5, Math.min(width - 0.5, u)), v: Math.max(-0.5, Math.min(height - 0.5, v)) };
  }

  /**
   * @param {"start" | "move" | "end" | "cancel"} phase
   * @param {import("../model/protocol.js").PinMark} pin
   */
  function message(phase, { camera, person, point, u, v }) {
    const { frame } = /** @type {Held} */ (held);
    send({ type: "pin", phase, frame, camera, person, point, u, v, live: store.facts.livePins });
  }

  /**
   * @param {number} person
   * @param {string | null} point
   * @param {number | null} camera
   */
  function unpin(person, point, camera) {
    const { state } = store.facts;
    if (state) send({ type: "unpin", frame: state.frame, person, point, camera });
  }

  /** @param {boolean} isKept whether to show the pin at its last position until the program's overlay arrives */
  function release(isKept) {
    if (!held) return;
    const { surface } = held.pane;
    held = null;
    surface.classList.remove("is-dragging");
    store.set({ dragging: false, ...(isKept ? {} : { heldPin: null }) });
    setTimeout(() => !held && store.facts.heldPin && store.set({ heldPin: null }), RESPONSE_MS);
  }

  return { toggle, toggleLive, cancel, remove, clear, fit, limb, fitLimb, takeLimbBack, watch };
}
