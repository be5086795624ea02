/** Puts the program's messages into the store. */

import { FrameAssembler } from "./frames.js";

export class Receiver {
  #store;
  #notify;
  #frames = new FrameAssembler(0, () => {});
  /** @type {import("./protocol.js").Overlay | null} vectors that came before the images of their frame */
  #early = null;

  /**
   * @param {import("./store.js").Store} store
   * @param {(notice: import("./protocol.js").NoticeMessage) => void} notify
   */
  constructor(store, notify) {
    this.#store = store;
    this.#notify = notify;
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
        break;
      case "timeline":
        this.#mergeTimeline(message);
        break;
      case "notice":
        this.#notify(message);
        break;
    }
  }

  /**
   * @param {import("./protocol.js").ImageHeader | import("./protocol.js").OverlayHeader} header
   * @param {ArrayBuffer} payload
   */
  onBinary(header, payload) {
    if (header.type === "image") {
      this.#frames.receive(header, payload);
    } else {
      const overlay = { ...header, segments: new Float32Array(payload) };
      // Vectors never lie over the image of another frame: the newest wait for theirs.
      const fits = this.#store.facts.shown?.frame === header.frame;
      this.#early = fits ? null : overlay;
      if (fits) this.#store.set({ overlay });
    }
  }

  /** @param {import("./protocol.js").SessionMessage} session */
  #begin(session) {
    this.#frames.close();
    this.#frames = new FrameAssembler(session.cameras.length, (shown) => this.#show(shown));
    this.#early = null;
    const former = this.#store.facts.session?.cameras;
    this.#store.set({ session });
    if (JSON.stringify(former) !== JSON.stringify(session.cameras)) this.#store.set({ shown: null, overlay: null });
  }

  /** @param {import("./store.js").Shown} shown */
  #show(shown) {
    const former = this.#store.facts.shown;
    this.#store.set({ shown });
    if (this.#early?.frame === shown.frame) {
      this.#store.set({ overlay: this.#early });
      this.#early = null;
    }
    former?.bitmaps.forEach((bitmap) => bitmap.close());
  }

  /** @param {import("./protocol.js").TimelineMessage} message */
  #mergeTimeline({ cells, replace }) {
    const timeline = replace ? new Map() : new Map(this.#store.facts.timeline);
    for (const [frame, cell] of Object.entries(cells)) {
      if (cell) timeline.set(Number(frame), cell);
      else timeline.delete(Number(frame));
    }
    this.#store.set({ timeline });
  }
}
