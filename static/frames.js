/** Puts the images of all cameras of one frame together, so that the panes change at once. */

/**
 * @typedef {import("./protocol.js").ImageHeader} ImageHeader
 * @typedef {{frame: number, base: import("./protocol.js").Base, blobs: Map<number, Blob>}} FrameSet
 */

export class FrameAssembler {
  #cameraCount;
  #onShow;
  /** @type {FrameSet | null} */
  #arriving = null;
  /** @type {FrameSet | null} the newest complete set that waits for the decoder */
  #waiting = null;
  #decoding = false;
  #closed = false;

  /**
   * @param {number} cameraCount
   * @param {(shown: import("./store.js").Shown) => void} onShow takes over the bitmaps
   */
  constructor(cameraCount, onShow) {
    this.#cameraCount = cameraCount;
    this.#onShow = onShow;
  }

  /**
   * Take one image. A set that was not complete when another frame or layer begins is dropped.
   *
   * @param {ImageHeader} header
   * @param {ArrayBuffer} jpeg
   */
  receive(header, jpeg) {
    if (this.#arriving?.frame !== header.frame || this.#arriving.base !== header.base) {
      this.#arriving = { frame: header.frame, base: header.base, blobs: new Map() };
    }
    this.#arriving.blobs.set(header.camera, new Blob([jpeg], { type: "image/jpeg" }));
    if (this.#arriving.blobs.size === this.#cameraCount) {
      this.#waiting = this.#arriving;
      this.#arriving = null;
      void this.#decode();
    }
  }

  /** Forget everything on its way. */
  close() {
    this.#closed = true;
  }

  async #decode() {
    if (this.#decoding) return;
    this.#decoding = true;
    while (this.#waiting) {
      const { frame, base, blobs } = this.#waiting;
      this.#waiting = null;
      const inOrder = Array.from({ length: this.#cameraCount }, (_, camera) => /** @type {Blob} */ (blobs.get(camera)));
      try {
        const bitmaps = await Promise.all(inOrder.map((blob) => createImageBitmap(blob)));
        if (this.#closed) bitmaps.forEach((bitmap) => bitmap.close());
        else this.#onShow({ frame, base, bitmaps });
      } catch (error) {
        console.error(`frame ${frame}: an image could not be decoded`, error);
      }
    }
    this.#decoding = false;
  }
}
