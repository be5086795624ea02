/** Put the program's messages into the store. */

import { forgetName } from "./connection.js";
import { Cells } from "./cells.js";
import { PICTURE_LAYERS } from "./layers.js";
import { PictureAssembler, keyOf } from "./pictures.js";
import { mergeCandidates, mergeSteps, takeLandscape, takeRuns } from "./search_runs.js";
import { mergeCurves } from "./series.js";

const MAX_EARLY = 8;

/**
 * @typedef {import("./store.js").Facts} Facts
 * @typedef {import("./protocol.js").TextMessage} TextMessage
 * @typedef {import("./protocol.js").BinaryHeader} BinaryHeader
 */

/**
 * Facts that a message changes, where it is not itself the fact of its name: `body_sizes` is the fact `bodySizes`.
 *
 * @type {{[Type in TextMessage["type"]]?: (message: Extract<TextMessage, {type: Type}>, facts: Facts) => Partial<Facts>}}
 */
const CHANGES = {
  imported: (observations) => ({ observations }),
  epipolar: (epipolarLines) => ({ epipolarLines }),
  other_copy: (message) => ({ otherCopy: message.name ? message : null }),
  range_comparison: (message) => ({ rangeComparison: message.first === null ? null : message }),
  inconsistent: ({ frames, keyframes }) => ({ disagreeing: frames, keyframeDoubts: keyframes }),
  search_runs: (message, facts) => takeRuns(facts, message),
};

/**
 * Facts that a binary message changes.
 *
 * @type {{[Type in BinaryHeader["type"]]?: (header: Extract<BinaryHeader, {type: Type}>, payload: ArrayBuffer, facts: Facts) => Partial<Facts>}}
 */
const BINARY_CHANGES = {
  curves: (header, payload, { curves, session }) => ({ curves: mergeCurves(curves, header, payload, session?.n_frames ?? 0) }),
  search_steps: (header, payload, { searchSteps }) => ({ searchSteps: mergeSteps(searchSteps, header, payload) }),
  search_candidates: (header, payload, { searchCandidates }) => ({ searchCandidates: mergeCandidates(searchCandidates, header, payload) }),
  landscape: (header, payload) => ({ landscape: takeLandscape(header, payload) }),
};

/** @param {string} type of a message */
function factOf(type) {
  return type.replace(/_(.)/g, (_, letter) => letter.toUpperCase());
}

export class Receiver {
  #store;
  #notify;
  #send;
  #recent;
  /** @type {PictureAssembler | null} */
  #pictures = null;
  /** @type {Map<number, import("./protocol.js").Overlay>} overlays that arrived before the images of their frame */
  #early = new Map();
  /** @type {{frame: number, person: number} | null} what was shown before the program was started again */
  #before = null;

  /**
   * @param {import("./store.js").Store} store
   * @param {(notice: import("./protocol.js").NoticeMessage) => void} notify
   * @param {(message: import("./protocol.js").ClientMessage) => void} send
   * @param {import("./recent_images.js").RecentImages} recent caches the images of recent frames
   */
  constructor(store, notify, send, recent) {
    this.#store = store;
    this.#send = send;
    this.#recent = recent;
    this.#notify = notify;
    store.on(["layers"], () => this.#forgetHidden());
  }

  /** @param {boolean} open */
  onOpen(open) {
    if (open !== this.#store.facts.connected) this.#store.set({ connected: open });
  }

  /** @param {TextMessage} message */
  onText(message) {
    if (message.type === "session") return this.#begin(message);
    if (message.type === "timeline") return this.#mergeTimeline(message);
    if (message.type === "notice") return this.#notify(message);
    if (message.type === "clocks" && this.#areSetAnew(message)) this.#recent.clear();
    if (message.type === "presence" && message.refusal) this.#refuse(message.refusal);
    const change = /** @type {((message: TextMessage, facts: Facts) => Partial<Facts>) | undefined} */ (CHANGES[message.type]);
    this.#store.set(change?.(message, this.#store.facts) ?? { [factOf(message.type)]: message });
    if (message.type === "state") this.#goBack(message);
  }

  /**
   * @param {BinaryHeader} header
   * @param {ArrayBuffer} payload
   */
  onBinary(header, payload) {
    if (header.type === "image") return this.#pictures?.receive(header, payload);
    if (header.type === "overlay") return this.#takeOverlay({ ...header, segments: new Float32Array(payload) });
    if (header.type === "cells") return this.#cells(header).take(header, payload);
    const change = /** @type {(header: BinaryHeader, payload: ArrayBuffer, facts: Facts) => Partial<Facts>} */ (BINARY_CHANGES[header.type]);
    this.#store.set(change(header, payload, this.#store.facts));
  }

  /**
   * Show an overlay, or keep it until the images of its frame arrive.
   *
   * @param {import("./protocol.js").Overlay} overlay
   */
  #takeOverlay(overlay) {
    const { layers, shown } = this.#store.facts;
    const isBare = !PICTURE_LAYERS.some((layer) => layers.shown[layer]);
    if (isBare && shown?.frame !== overlay.frame) this.#show(overlay.frame, new Map());
    if (this.#store.facts.shown?.frame === overlay.frame) {
      this.#store.set({ overlay });
      return;
    }
    this.#early.delete(overlay.frame);
    this.#early.set(overlay.frame, overlay);
    // A tracker can be some frames ahead of decoding. Older overlays belong to skipped frames.
    for (const frame of this.#early.keys()) if (this.#early.size > MAX_EARLY) this.#early.delete(frame);
  }

  /** @param {import("./protocol.js").ClocksMessage} clocks whether a camera shows pictures of another time by them */
  #areSetAnew({ cameras }) {
    const before = this.#store.facts.clocks?.cameras ?? [];
    return cameras.some((c, i) => c.offset_frames !== before[i]?.offset_frames || c.drift_ms_per_s !== before[i].drift_ms_per_s);
  }

  /** @param {string} refusal why the name of this tab could not be had */
  #refuse(refusal) {
    forgetName();
    this.#notify({ type: "notice", level: "error", text: refusal });
  }

  /** @param {import("./protocol.js").SessionMessage} session */
  #begin(session) {
    this.#pictures?.close();
    this.#pictures = new PictureAssembler((frame, pictures) => this.#show(frame, pictures));
    this.#early.clear();
    this.#recent.clear(); // the footage may have changed while disconnected
    const { session: previous, state } = this.#store.facts;
    const isStartedAgain = previous?.name === session.name && previous.start !== session.start;
    this.#before = isStartedAgain && state ? { frame: state.frame, person: state.person } : null;
    this.#store.set({ session, lanes: [] });
    if (JSON.stringify(previous?.cameras) !== JSON.stringify(session.cameras)) this.#store.set({ shown: null, overlay: null });
  }

  /**
   * Go back to what was shown before the program was started again, unless another page has gone elsewhere since.
   *
   * @param {import("./protocol.js").StateMessage} state of the new start
   */
  #goBack({ frame, person, point }) {
    const before = this.#before;
    this.#before = null;
    if (!before || frame !== 0) return;
    if (before.person !== person) this.#send({ type: "select", person: before.person, point });
    if (before.frame !== 0) this.#send({ type: "seek", frame: before.frame });
  }

  /**
   * Show new pictures. They replace all pictures of another frame, or those of the same layer of the same frame.
   *
   * @param {number} frame
   * @param {import("./pictures.js").Pictures} pictures
   */
  #show(frame, pictures) {
    const { shown } = this.#store.facts;
    const merged = new Map(shown?.frame === frame ? shown.pictures : []);
    for (const [key, { bitmap }] of shown?.pictures ?? []) {
      if (merged.has(key) && !pictures.has(key)) continue;
      bitmap.close();
    }
    for (const [key, picture] of pictures) merged.set(key, picture);
    this.#store.set({ shown: { frame, pictures: merged } });
    this.#recent.keep(frame, pictures);
    const overlay = this.#early.get(frame);
    if (overlay) {
      this.#store.set({ overlay });
      this.#early.delete(frame);
    }
  }

  /** Discard pictures of hidden layers, which may become outdated. The program sends a layer when it is shown again. */
  #forgetHidden() {
    const { shown, layers, session } = this.#store.facts;
    for (const layer of PICTURE_LAYERS) {
      if (layers.shown[layer]) continue;
      for (const camera of session?.cameras.keys() ?? []) {
        shown?.pictures.get(keyOf(layer, camera))?.bitmap.close();
        shown?.pictures.delete(keyOf(layer, camera));
      }
    }
  }

  /** @param {import("./protocol.js").TimelineMessage} message */
  #mergeTimeline(message) {
    const cells = this.#cells(message);
    for (const [frame, cell] of Object.entries(message.cells)) cells.set(Number(frame), cell);
  }

  /**
   * Return the cells to change in place, since a tracker changes a few of 100,000 cells twice a second.
   *
   * @param {{replace: boolean, person: number | null}} message `replace` to start empty; `person` null for
   *   the cells of all people
   */
  #cells({ replace, person }) {
    const { facts } = this.#store;
    const known = person === null ? facts.timeline : facts.lanes[person];
    const cells = replace || !known ? new Cells(facts.session?.n_frames ?? 0) : known;
    if (person === null) this.#store.set({ timeline: cells });
    else this.#store.set({ lanes: Object.assign([...facts.lanes], { [person]: cells }) });
    return cells;
  }
}
