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

/**
 * @typedef {import("./drawing.js").PlacedHandle} PlacedHandle
 * @typedef {{pane: import("./pane.js").Pane, frame: number, camera: number, pointer: number, person: number, point: string,
 *   part: number | null, mode: import("../model/protocol.js").DragMode, start: {x: number, y: number},
 *   grabbed: {u: number, v: number}, at: {u: number, v: number}, offset: {u: number, v: number}, begun: boolean}} Drag
 */

export class Gestures {
  #store;
  #send;
  #latency;
  /** @type {Drag | null} */
  #drag = null;
  /**
   * @type {{pane: import("./pane.js").Pane, pointer: number, x: number, y: number, start: {x: number, y: number},
   *   person: number | null} | null} person: the dimmed person to select if the gesture is a click
   */
  #pan = null;
  #hint = new DragHint();
  #picking = new JointPicking();
  /** @type {{pane: import("./pane.js").Pane, camera: number, at: {x: number, y: number}} | null} the pointer over a pane */
  #pointer = null;
  #seq = 0;
  #movesSent = -Infinity;

  /**
   * @param {import("../model/store.js").Store} store
   * @param {(message: import("../model/protocol.js").ClientMessage) => void} send
   * @param {import("../widgets/latency.js").Latency} latency
   */
  constructor(store, send, latency) {
    this.#store = store;
    this.#send = send;
    this.#latency = latency;
    store.on(["connected"], () => {
      this.#release();
      this.#latency.forget();
    });
  }

  /**
   * Handle the pointer in a pane.
   *
   * @param {import("./pane.js").Pane} pane
   * @param {number} camera
   */
  watch(pane, camera) {
    const surface = pane.surface;
    surface.addEventListener("pointerdown", (event) => this.#down(event, pane, camera));
    surface.addEventListener("pointermove", (event) => this.#move(event, pane, camera));
    // Not all browsers have raw updates. The others merge the moves of an animation frame.
    surface.addEventListener("pointerrawupdate", (event) => {
      if (this.#drag?.pointer === /** @type {PointerEvent} */ (event).pointerId && this.#drag.begun) {
        this.#dragTo(this.#drag, /** @type {PointerEvent} */ (event), MIN_INTERVAL_MS);
      }
    });
    for (const kind of ["pointerenter", "pointerdown"]) {
      surface.addEventListener(kind, () => this.#store.facts.active !== camera && this.#store.set({ active: camera }));
    }
    surface.addEventListener("pointerup", (event) => this.#up(event));
    surface.addEventListener("pointercancel", () => this.cancel());
    surface.addEventListener("pointerleave", () => {
      this.#pointer = null;
      if (!this.#drag && (this.#store.facts.hover || this.#store.facts.hoverPart)) this.#store.set({ hover: null, hoverPart: null });
    });
    // Prevent scrolling, and pasting on some systems.
    surface.addEventListener("mousedown", (event) => event.button === 1 && event.preventDefault());
  }

  /** Cancel the current gesture and revert its drag. Returns whether there was one. */
  cancel() {
    const held = this.#drag !== null || this.#pan !== null;
    if (this.#drag?.begun) this.#message("cancel", this.#drag.grabbed);
    this.#release();
    return held;
  }

  /**
   * The joint under the pointer that a press takes, and those that overlap it.
   *
   * @param {import("./pane.js").Pane} pane
   * @param {{x: number, y: number}} at
   */
  #hit(pane, at) {
    const { layers, state } = this.#store.facts;
    if (!this.#store.isSettled || !layers.shown.joints || state?.floor) return null;
    return this.#picking.pick(pane.graspableHandles(), at, state?.person ?? 0);
  }

  /** Offer the next of the joints that overlap under the pointer. */
  offerNext() {
    if (!this.#pointer || this.#drag || !this.#picking.next()) return;
    this.#hoverAt(this.#pointer.pane, this.#pointer.camera, this.#pointer.at);
  }

  /**
   * The part under the pointer, with the data that a drag needs. The grabbed point is the pointer's position.
   *
   * @param {import("./pane.js").Pane} pane
   * @param {number} camera
   * @param {{x: number, y: number}} at
   */
  #hitPart(pane, camera, at) {
    const { layers, overlay, state, bare } = this.#store.facts;
    if (!this.#store.isSettled || !overlay || !layers.shown.joints || state?.floor || bare) return null;
    const place = pane.view.toImage(at.x, at.y);
    const found = partAt(overlay, camera, place, (person) => !isDimmed(state, person));
    if (!found) return null;
    // Joint i moves part i; touching the part selects the joint.
    const point = this.#store.facts.session?.people[found.person]?.points[found.part] ?? "";
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
  #dimmedAt(pane, camera, at, mouseButton) {
    const { overlay, state } = this.#store.facts;
    if (!overlay || !state?.solo || state.floor || mouseButton !== 0) return null;
    return partAt(overlay, camera, pane.view.toImage(at.x, at.y), (person) => isDimmed(state, person))?.person ?? null;
  }

  /**
   * @param {PointerEvent} event
   * @param {import("./pane.js").Pane} pane
   * @param {number} camera
   */
  #down(event, pane, camera) {
    if (this.#drag || this.#pan || event.button > 1) return;
    const at = pane.locate(event);
    const hit = event.button === 0 ? (this.#hit(pane, at)?.meant ?? this.#hitPart(pane, camera, at)) : null;
    pane.surface.setPointerCapture(event.pointerId);
    if (!hit) {
      const start = { x: event.clientX, y: event.clientY };
      this.#pan = { pane, pointer: event.pointerId, ...start, start, person: this.#dimmedAt(pane, camera, at, event.button) };
      pane.surface.classList.add("is-panning");
      return;
    }
    const { person, point, u, v, part } = "handle" in hit ? { ...hit.handle, part: null } : hit;
    const pointer = pane.view.toImage(at.x, at.y);
    this.#drag = {
      pane,
      frame: this.#store.facts.shown?.frame ?? 0,
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
    const pressed = { person, point, state: this.#store.facts.state };
    const held = part === null ? { hover: { camera, person, point } } : { hoverPart: { camera, person, part } };
    this.#store.set({ dragging: true, hover: null, hoverPart: null, pressed, ...held });
    this.#send({ type: "select", person, point });
  }

  /**
   * @param {PointerEvent} event
   * @param {import("./pane.js").Pane} pane
   * @param {number} camera
   */
  #move(event, pane, camera) {
    if (this.#pan?.pointer === event.pointerId) {
      this.#pan.pane.panBy(event.clientX - this.#pan.x, event.clientY - this.#pan.y);
      [this.#pan.x, this.#pan.y] = [event.clientX, event.clientY];
    } else if (this.#drag?.pointer === event.pointerId) {
      this.#drag.mode = modeOf(event);
      this.#dragTo(this.#drag, event);
      if (this.#drag.begun) this.#hint.show(this.#drag.mode, pane.element);
    } else if (!this.#drag && !this.#pan) {
      this.#hoverAt(pane, camera, pane.locate(event));
    }
  }

  /**
   * Move the grabbed point to the pointer.
   *
   * @param {Drag} drag
   * @param {PointerEvent} event
   * @param {number} intervalMs minimum time since the last message; an earlier move is skipped
   */
  #dragTo(drag, event, intervalMs = 0) {
    const at = drag.pane.locate(event);
    if (!drag.begun) {
      if (Math.hypot(at.x - drag.start.x, at.y - drag.start.y) < DRAG_THRESHOLD) return;
      drag.begun = true;
      this.#message("start", drag.grabbed);
    }
    const pointer = drag.pane.view.toImage(at.x, at.y);
    const { u, v } = { u: pointer.u + drag.offset.u, v: pointer.v + drag.offset.v };
    if ((u === drag.at.u && v === drag.at.v) || performance.now() < this.#movesSent + intervalMs) return;
    drag.at = { u, v };
    this.#movesSent = performance.now();
    this.#latency.sent(this.#message("move", drag.at), event.timeStamp);
  }

  /** @param {PointerEvent} event */
  #up(event) {
    const pointer = this.#drag?.pointer ?? this.#pan?.pointer;
    if (event.pointerId !== pointer) return;
    if (this.#drag?.begun) this.#message("end", this.#drag.at);
    // A click selects; the next press at the same place takes the other of an overlapping pair.
    else if (this.#drag && this.#drag.part === null) {
      if (event.shiftKey) this.#toggleHold(this.#drag);
      else this.#picking.next();
    }
    const pan = this.#pan;
    if (pan?.person != null && Math.hypot(event.clientX - pan.start.x, event.clientY - pan.start.y) < DRAG_THRESHOLD) {
      this.#send({ type: "select", person: pan.person, point: null });
    }
    this.#release();
  }

  /**
   * @param {import("./pane.js").Pane} pane
   * @param {number} camera
   * @param {{x: number, y: number}} at
   */
  #hoverAt(pane, camera, at) {
    this.#pointer = { pane, camera, at };
    const found = this.#hit(pane, at);
    const hit = found?.meant ?? null;
    const { hover, hoverPart } = this.#store.facts;
    const part = hit ? null : this.#hitPart(pane, camera, at);
    pane.surface.classList.toggle("is-over-joint", hit !== null);
    pane.surface.classList.toggle("is-over-part", part !== null);
    if (hoverPart?.camera !== part?.camera || hoverPart?.person !== part?.person || hoverPart?.part !== part?.part) {
      this.#store.set({ hoverPart: part && { camera, person: part.person, part: part.part } });
    }
    if (!hit) {
      if (hover) this.#store.set({ hover: null });
    } else {
      const { person, point } = hit.handle;
      const overlapping = found?.overlapping.map(({ handle }) => ({ person: handle.person, point: handle.point })) ?? [];
      const isSame = hover?.camera === camera && hover.person === person && hover.point === point;
      if (!isSame || hover.overlapping?.length !== overlapping.length) {
        this.#store.set({ hover: { camera, person, point, overlapping } });
      }
    }
  }

  /**
   * @param {"start" | "move" | "end" | "cancel"} phase
   * @param {{u: number, v: number}} at
   * @returns  the number of the message
   */
  #message(phase, { u, v }) {
    const { frame, camera, person, point, part, mode } = /** @type {Drag} */ (this.#drag);
    this.#seq += 1;
    this.#send({ type: "drag", phase, frame, camera, person, point, part, mode, u, v, seq: this.#seq });
    return this.#seq;
  }

  /** @param {Drag} drag */
  #toggleHold({ frame, camera, person, point }) {
    const handle = this.#store.facts.overlay?.handles.find(
      (one) => one.camera === camera && one.person === person && one.point === point,
    );
    this.#send({ type: "pose", action: "hold", frame, person, point, held: !handle?.held });
  }

  #release() {
    const surface = (this.#drag ?? this.#pan)?.pane.surface;
    surface?.classList.remove("is-dragging", "is-panning");
    this.#hint.hide();
    this.#drag = null;
    this.#pan = null;
    if (this.#store.facts.dragging) this.#store.set({ dragging: false });
  }
}
