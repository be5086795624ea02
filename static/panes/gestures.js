/**
 * Pointer gestures in a pane. A drag on a joint moves the joint; elsewhere, or with the middle button, it moves the view.
 *
 * A drag keeps the offset between pointer and joint, and begins after a few pixels, since a click only selects. Messages are
 * sent when the pointer moves, about one per animation frame, without waiting for the next frame.
 */

const DRAG_THRESHOLD = 3;
/** Minimum interval of messages. Some mice report moves a thousand times a second. */
const MIN_INTERVAL_MS = 12;

import { isDimmed } from "../model/selectors.js";
import { DragHint, modeOf } from "./drag_hint.js";
import { JointPicking } from "./joint_picking.js";
import { partAt } from "./part_hit.js";
import { isSame } from "./pin_drawing.js";

/**
 * @typedef {import("./drawing.js").PlacedHandle} PlacedHandle
 * @typedef {{pane: import("./pane.js").Pane, frame: number, camera: number, pointer: number, person: number, point: string,
 *   part: number | null, mode: import("../model/protocol.js").DragMode, start: {x: number, y: number},
 *   grabbed: {u: number, v: number}, at: {u: number, v: number}, offset: {u: number, v: number}, begun: boolean}} Drag
 */

/** @typedef {ReturnType<typeof makeGestures>} Gestures */

/**
 * @param {import("../model/store.js").Store} store
 * @param {(message: import("../model/protocol.js").ClientMessage) => void} send
 * @param {import("../widgets/latency.js").Latency} latency
 */
export function makeGestures(store, send, latency) {
  /** @type {Drag | null} */
  let drag = null;
  /**
   * @type {{pane: import("./pane.js").Pane, pointer: number, x: number, y: number, start: {x: number, y: number},
   *   person: number | null} | null} person: the dimmed person to select if the gesture is a click
   */
  let panning = null;
  const hint = new DragHint();
  const picking = new JointPicking();
  /** @type {{pane: import("./pane.js").Pane, camera: number, at: {x: number, y: number}} | null} the pointer over a pane */
  let pointer = null;
  let seq = 0;
  let movesSent = -Infinity;
  store.on(["connected"], () => {
    release();
    latency.forget();
  });

  /**
   * Handle the pointer in a pane.
   *
   * @param {import("./pane.js").Pane} pane
   * @param {number} camera
   */
  function watch(pane, camera) {
    const surface = pane.surface;
    surface.addEventListener("pointerdown", (event) => down(event, pane, camera));
    surface.addEventListener("pointermove", (event) => move(event, pane, camera));
    // Not all browsers have raw updates. The others merge the moves of an animation frame.
    surface.addEventListener("pointerrawupdate", (event) => {
      if (drag?.pointer === /** @type {PointerEvent} */ (event).pointerId && drag.begun) {
        dragTo(drag, /** @type {PointerEvent} */ (event), MIN_INTERVAL_MS);
      }
    });
    for (const kind of ["pointerenter", "pointerdown"]) {
      surface.addEventListener(kind, () => store.facts.active !== camera && store.set({ active: camera }));
    }
    surface.addEventListener("pointerup", (event) => up(event));
    surface.addEventListener("pointercancel", () => cancel());
    surface.addEventListener("pointerleave", () => {
      pointer = null;
      if (!drag && (store.facts.hover || store.facts.hoverPart)) store.set({ hover: null, hoverPart: null });
    });
    // Prevent scrolling, and pasting on some systems.
    surface.addEventListener("mousedown", (event) => event.button === 1 && event.preventDefault());
  }

  /** Cancel the current gesture and revert its drag. Returns whether there was one. */
  function cancel() {
    const held = drag !== null || panning !== null;
    if (drag?.begun) message("cancel", drag.grabbed);
    release();
    return held;
  }

  /**
   * The joint under the pointer that a press takes, and those that overlap it.
   *
   * @param {import("./pane.js").Pane} pane
   * @param {{x: number, y: number}} at
   */
  function hitAt(pane, at) {
    const { layers, state } = store.facts;
    if (!store.isSettled || !layers.shown.joints || state?.floor) return null;
    return picking.pick(pane.graspableHandles(), at, state?.person ?? 0);
  }

  /** Offer the next of the joints that overlap under the pointer. */
  function offerNext() {
    if (!pointer || drag || !picking.next()) return;
    hoverAt(pointer.pane, pointer.camera, pointer.at);
  }

  /**
   * The part under the pointer, with the data that a drag needs. The grabbed point is the pointer's position.
   *
   * @param {import("./pane.js").Pane} pane
   * @param {number} camera
   * @param {{x: number, y: number}} at
   */
  function hitPart(pane, camera, at) {
    const { layers, overlay, state, bare } = store.facts;
    if (!store.isSettled || !overlay || !layers.shown.joints || state?.floor || bare) return null;
    const place = pane.view.toImage(at.x, at.y);
    const found = partAt(overlay, camera, place, (person) => !isDimmed(state, person));
    if (!found) return null;
    // Joint i moves part i; touching the part selects the joint.
    const point = store.facts.session?.people[found.person]?.points[found.part] ?? "";
    return { camera, person: found.person, part: found.part, point, ...place };
  }

  /**
   * The dimmed person under the pointer. A click selects that person, but a drag does not move the body.
   *
   * @param {import("./pane.js").Pane} pane
   * @param {number} camera
   * @param {{x: number, y: number}} at
   * @param {number} mouseButton
   */
  function dimmedAt(pane, camera, at, mouseButton) {
    const { overlay, state } = store.facts;
    if (!overlay || !state?.solo || state.floor || mouseButton !== 0) return null;
    return partAt(overlay, camera, pane.view.toImage(at.x, at.y), (person) => isDimmed(state, person))?.person ?? null;
  }

  /**
   * @param {PointerEvent} event
   * @param {import("./pane.js").Pane} pane
   * @param {number} camera
   */
  function down(event, pane, camera) {
    if (drag || panning || event.button > 1) return;
    const at = pane.locate(event);
    const hit = event.button === 0 ? (hitAt(pane, at)?.meant ?? hitPart(pane, camera, at)) : null;
    pane.surface.setPointerCapture(event.pointerId);
    if (!hit) {
      const start = { x: event.clientX, y: event.clientY };
      panning = { pane, pointer: event.pointerId, ...start, start, person: dimmedAt(pane, camera, at, event.button) };
      pane.surface.classList.add("is-panning");
      return;
    }
    const { person, point, u, v, part } = "handle" in hit ? { ...hit.handle, part: null } : hit;
    const pointer = pane.view.toImage(at.x, at.y);
    drag = {
      pane,
      frame: store.facts.shown?.frame ?? 0,
      camera,
      pointer: event.pointerId,
      person,
      point,
      part,
      mode: modeOf(event),
      start: at,
      grabbed: { u, v },
      at: { u, v },
      offset: { u: u - pointer.u, v: v - pointer.v },
      begun: false,
    };
    pane.surface.classList.add("is-dragging");
    const pressed = { person, point, state: store.facts.state };
    const held = part === null ? { hover: { camera, person, point } } : { hoverPart: { camera, person, part } };
    store.set({ dragging: true, hover: null, hoverPart: null, pressed, ...held });
    send({ type: "select", person, point });
  }

  /**
   * @param {PointerEvent} event
   * @param {import("./pane.js").Pane} pane
   * @param {number} camera
   */
  function move(event, pane, camera) {
    if (panning?.pointer === event.pointerId) {
      panning.pane.panBy(event.clientX - panning.x, event.clientY - panning.y);
      [panning.x, panning.y] = [event.clientX, event.clientY];
    } else if (drag?.pointer === event.pointerId) {
      drag.mode = modeOf(event);
      dragTo(drag, event);
      if (drag.begun) hint.show(drag.mode, pane.element);
    } else if (!drag && !panning) {
      hoverAt(pane, camera, pane.locate(event));
    }
  }

  /**
   * Move the grabbed point to the pointer.
   *
   * @param {Drag} drag
   * @param {PointerEvent} event
   * @param {number} intervalMs minimum time since the last message; an earlier move is skipped
   */
  function dragTo(drag, event, intervalMs = 0) {
    const at = drag.pane.locate(event);
    if (!drag.begun) {
      if (Math.hypot(at.x - drag.start.x, at.y - drag.start.y) < DRAG_THRESHOLD) return;
      drag.begun = true;
      message("start", drag.grabbed);
    }
    const pointer = drag.pane.view.toImage(at.x, at.y);
    const { u, v } = { u: pointer.u + drag.offset.u, v: pointer.v + drag.offset.v };
    if ((u === drag.at.u && v === drag.at.v) || performance.now() < movesSent + intervalMs) return;
    drag.at = { u, v };
    movesSent = performance.now();
    latency.sent(message("move", drag.at), event.timeStamp);
  }

  /** @param {PointerEvent} event */
  function up(event) {
    const pointer = drag?.pointer ?? panning?.pointer;
    if (event.pointerId !== pointer) return;
    if (drag?.begun) message("end", drag.at);
    // A click selects; the next press at the same place takes the other of an overlapping pair.
    else if (drag && drag.part === null) {
      if (event.shiftKey) toggleHold(drag);
      else picking.next();
    }
    const pan = panning;
    if (pan?.person != null && Math.hypot(event.clientX - pan.start.x, event.clientY - pan.start.y) < DRAG_THRESHOLD) {
      send({ type: "select", person: pan.person, point: null });
    }
    release();
  }

  /**
   * @param {import("./pane.js").Pane} pane
   * @param {number} camera
   * @param {{x: number, y: number}} at
   */
  function hoverAt(pane, camera, at) {
    pointer = { pane, camera, at };
    const found = hitAt(pane, at);
    const hit = found?.meant ?? null;
    const { hover, hoverPart } = store.facts;
    const part = hit ? null : hitPart(pane, camera, at);
    pane.surface.classList.toggle("is-over-joint", hit !== null);
    pane.surface.classList.toggle("is-over-part", part !== null);
    if (hoverPart?.camera !== part?.camera || hoverPart?.person !== part?.person || hoverPart?.part !== part?.part) {
      store.set({ hoverPart: part && { camera, person: part.person, part: part.part } });
    }
    if (!hit) {
      if (hover) store.set({ hover: null });
    } else {
      const { person, point } = hit.handle;
      const overlapping = found?.overlapping.map(({ handle }) => ({ person: handle.person, point: handle.point })) ?? [];
      const isSame = hover?.camera === camera && hover.person === person && hover.point === point;
      if (!isSame || hover.overlapping?.length !== overlapping.length) {
        store.set({ hover: { camera, person, point, overlapping } });
      }
    }
  }

  /**
   * @param {"start" | "move" | "end" | "cancel"} phase
   * @param {{u: number, v: number}} at
   * @returns  the number of the message
   */
  function message(phase, { u, v }) {
    const { frame, camera, person, point, part, mode } = /** @type {Drag} */ (drag);
    seq += 1;
    send({ type: "drag", phase, frame, camera, person, point, part, mode, u, v, seq });
    return seq;
  }

  /** @param {Drag} drag */
  function toggleHold({ frame, camera, person, point }) {
    const handle = store.facts.overlay?.handles.find((one) => isSame(one, { camera, person, point }));
    send({ type: "pose", action: "hold", frame, person, point, held: !handle?.held });
  }

  function release() {
    const surface = (drag ?? panning)?.pane.surface;
    surface?.classList.remove("is-dragging", "is-panning");
    hint.hide();
    drag = null;
    panning = null;
    if (store.facts.dragging) store.set({ dragging: false });
  }

  return { watch, cancel, offerNext };
}
