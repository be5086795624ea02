/** Put the program's messages into the store. */

import { forgetName } from "./connection.js";
import { Cells } from "./cells.js";
import { PICTURE_LAYERS } from "./layers.js";
import { makePictureAssembler, keyOf } from "./pictures.js";
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

/**
 * @param {import("./store.js").Store} store
 * @param {(notice: import("./protocol.js").NoticeMessage) => void} notify
 * @param {(message: import("./protocol.js").ClientMessage) => void} send
 * @param {import("./recent_images.js").RecentImages} recent caches the images of recent frames
 */
export function makeReceiver(store, notify, send, recent) {
  /** @type {import("./pictures.js").PictureAssembler | null} */
  let pictures = null;
  /** @type {Map<number, import("./protocol.js").Overlay>} overlays that arrived before the images of their frame */
  const early = new Map();
  /** @type {{frame: number, person: number} | null} what was shown before the program was started again */
  let shownBefore = null;
  store.on(["layers"], () => forgetHidden());

  /** @param {boolean} open */
  function onOpen(open) {
    if (open !== store.facts.connected) store.set({ connected: open });
  }

  /** @param {TextMessage} message */
  function onText(message) {
    if (message.type === "session") return begin(message);
    if (message.type === "timeline") return mergeTimeline(message);
    if (message.type === "notice") return notify(message);
    if (message.type === "clocks" && areSetAnew(message)) recent.clear();
    if (message.type === "presence" && message.refusal) refuse(message.refusal);
    const change = /** @type {((message: TextMessage, facts: Facts) => Partial<Facts>) | undefined} */ (CHANGES[message.type]);
    store.set(change?.(message, store.facts) ?? { [factOf(message.type)]: message });
    if (message.type === "state") goBack(message);
  }

  /**
   * @param {BinaryHeader} header
   * @param {ArrayBuffer} payload
   */
  function onBinary(header, payload) {
    if (header.type === "image") return pictures?.receive(header, payload);
    if (header.type === "overlay") return takeOverlay({ ...header, segments: new Float32Array(payload) });
    if (header.type === "cells") return cellsOf(header).take(header, payload);
    const change = /** @type {(header: BinaryHeader, payload: ArrayBuffer, facts: Facts) => Partial<Facts>} */ (BINARY_CHANGES[header.type]);
    store.set(change(header, payload, store.facts));
  }

  /**
   * Show an overlay, or keep it until the images of its frame arrive.
   *
   * @param {import("./protocol.js").Overlay} overlay
   */
  function takeOverlay(overlay) {
    const { layers, shown } = store.facts;
    const isBare = !PICTURE_LAYERS.some((layer) => layers.shown[layer]);
    if (isBare && shown?.frame !== overlay.frame) show(overlay.frame, new Map());
    if (store.facts.shown?.frame === overlay.frame) {
      store.set({ overlay });
      return;
    }
    early.delete(overlay.frame);
    early.set(overlay.frame, overlay);
    // A tracker can be some frames ahead of decoding. Older overlays belong to skipped frames.
    for (const frame of early.keys()) if (early.size > MAX_EARLY) early.delete(frame);
  }

  /** @param {import("./protocol.js").ClocksMessage} clocks whether a camera shows pictures of another time by them */
  function areSetAnew({ cameras }) {
    const before = store.facts.clocks?.cameras ?? [];
    return cameras.some((c, i) => c.offset_frames !== before[i]?.offset_frames || c.drift_ms_per_s !== before[i].drift_ms_per_s);
  }

  /** @param {string} refusal why the name of this tab could not be had */
  function refuse(refusal) {
    forgetName();
    notify({ type: "notice", level: "error", text: refusal });
  }

  /** @param {import("./protocol.js").SessionMessage} session */
  function begin(session) {
    pictures?.close();
    pictures = makePictureAssembler((frame, pictures) => show(frame, pictures));
    early.clear();
    recent.clear(); // the footage may have changed while disconnected
    const { session: previous, state } = store.facts;
    const isStartedAgain = previous?.name === session.name && previous.start !== session.start;
    shownBefore = isStartedAgain && state ? { frame: state.frame, person: state.person } : null;
    store.set({ session, lanes: [] });
    if (JSON.stringify(previous?.cameras) !== JSON.stringify(session.cameras)) store.set({ shown: null, overlay: null });
  }

  /**
   * Go back to what was shown before the program was started again, unless another page has gone elsewhere since.
   *
   * @param {import("./protocol.js").StateMessage} state of the new start
   */
  function goBack({ frame, person, point }) {
    const before = shownBefore;
    shownBefore = null;
    if (!before || frame !== 0) return;
    if (before.person !== person) send({ type: "select", person: before.person, point });
    if (before.frame !== 0) send({ type: "seek", frame: before.frame });
  }

  /**
   * Show new pictures. They replace all pictures of another frame, or those of the same layer of the same frame.
   *
   * @param {number} frame
   * @param {import("./pictures.js").Pictures} pictures
   */
  function show(frame, pictures) {
    const { shown } = store.facts;
    const merged = new Map(shown?.frame === frame ? shown.pictures : []);
    for (const [key, { bitmap }] of shown?.pictures ?? []) {
      if (merged.has(key) && !pictures.has(key)) continue;
      bitmap.close();
    }
    for (const [key, picture] of pictures) merged.set(key, picture);
    store.set({ shown: { frame, pictures: merged } });
    recent.keep(frame, pictures);
    const overlay = early.get(frame);
    if (overlay) {
      store.set({ overlay });
      early.delete(frame);
    }
  }

  /** Discard pictures of hidden layers, which may become outdated. The program sends a layer when it is shown again. */
  function forgetHidden() {
    const { shown, layers, session } = store.facts;
    for (const layer of PICTURE_LAYERS) {
      if (layers.shown[layer]) continue;
      for (const camera of session?.cameras.keys() ?? []) {
        shown?.pictures.get(keyOf(layer, camera))?.bitmap.close();
        shown?.pictures.delete(keyOf(layer, camera));
      }
    }
  }

  /** @param {import("./protocol.js").TimelineMessage} message */
  function mergeTimeline(message) {
    const cells = cellsOf(message);
    for (const [frame, cell] of Object.entries(message.cells)) cells.set(Number(frame), cell);
  }

  /**
   * Return the cells to change in place, since a tracker changes a few of 100,000 cells twice a second.
   *
   * @param {{replace: boolean, person: number | null}} message `replace` to start empty; `person` null for
   *   the cells of all people
   */
  function cellsOf({ replace, person }) {
    const { facts } = store;
    const known = person === null ? facts.timeline : facts.lanes[person];
    const cells = replace || !known ? new Cells(facts.session?.n_frames ?? 0) : known;
    if (person === null) store.set({ timeline: cells });
    else store.set({ lanes: Object.assign([...facts.lanes], { [person]: cells }) });
    return cells;
  }

  return { onOpen, onText, onBinary };
}
