/** Put the program's messages into the store. */

import { forgetName } from "./connection.js";
import { Cells } from "./cells.js";
import { PICTURE_LAYERS } from "./layers.js";
import { PictureAssembler, keyOf } from "./pictures.js";
import { mergeCandidates, mergeSteps, takeLandscape, takeRuns } from "./search_runs.js";
import { mergeCurves } from "./series.js";

const MAX_EARLY = 8;

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

  /** @param {import("./protocol.js").TextMessage} message */
  onText(message) {
    switch (message.type) {
      case "session":
        this.#begin(message);
        break;
      case "state":
        this.#store.set({ state: message });
        this.#goBack(message);
        break;
      case "timeline":
        this.#mergeTimeline(message);
        break;
      case "settings":
        this.#store.set({ settings: message });
        break;
      case "view_3d":
        this.#store.set({ view3d: message });
        break;
      case "finding":
        this.#store.set({ finding: message });
        break;
      case "calibration":
        this.#store.set({ calibration: message });
        break;
      case "imported":
        this.#store.set({ observations: message });
        break;
      case "annotation":
        this.#store.set({ annotation: message });
        break;
      case "presence":
        if (message.refusal) this.#refuse(message.refusal);
        this.#store.set({ presence: message });
        break;
      case "provenance":
        this.#store.set({ provenance: message });
        break;
      case "annotators":
        this.#store.set({ annotators: message });
        break;
      case "other_copy":
        this.#store.set({ otherCopy: message.name ? message : null });
        break;
      case "acquisition":
        this.#store.set({ acquisition: message });
        break;
      case "body_sizes":
        this.#store.set({ bodySizes: message });
        break;
      case "search_setup":
        this.#store.set({ searchSetup: message });
        break;
      case "search_runs":
        this.#store.set(takeRuns(this.#store.facts, message));
        break;
      case "observability":
        this.#store.set({ observability: message });
        break;
      case "epipolar":
        this.#store.set({ epipolarLines: message });
        break;
      case "reason":
        this.#store.set({ reason: message });
        break;
      case "cost_map":
        this.#store.set({ costMap: message });
        break;
      case "range_comparison":
        this.#store.set({ rangeComparison: message.first === null ? null : message });
        break;
      case "inconsistent":
        this.#store.set({ disagreeing: message.frames, keyframeDoubts: message.keyframes });
        break;
      case "history":
        this.#store.set({ history: message });
        break;
      case "notice":
        this.#notify(message);
        break;
    }
  }

  /**
   * @param {import("./protocol.js").BinaryHeader} header
   * @param {ArrayBuffer} payload
   */
  onBinary(header, payload) {
    switch (header.type) {
      case "image":
        this.#pictures?.receive(header, payload);
        break;
      case "overlay":
        this.#takeOverlay({ ...header, segments: new Float32Array(payload) });
        break;
      case "cells":
        this.#cells(header).take(header, payload);
        break;
      case "curves":
        this.#store.set({ curves: mergeCurves(this.#store.facts.curves, header, payload, this.#frameCount) });
        break;
      case "search_steps":
        this.#store.set({ searchSteps: mergeSteps(this.#store.facts.searchSteps, header, payload) });
        break;
      case "search_candidates":
        this.#store.set({ searchCandidates: mergeCandidates(this.#store.facts.searchCandidates, header, payload) });
        break;
      case "landscape":
        this.#store.set({ landscape: takeLandscape(header, payload) });
        break;
    }
  }

  get #frameCount() {
    return this.#store.facts.session?.n_frames ?? 0;
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
    const cells = replace || !known ? new Cells(this.#frameCount) : known;
    if (person === null) this.#store.set({ timeline: cells });
    else this.#store.set({ lanes: Object.assign([...facts.lanes], { [person]: cells }) });
    return cells;
  }
}
