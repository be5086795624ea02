/** Assemble the pictures of a set, so that all panes change at once. The browser decodes them asynchronously. */

/**
 * @typedef {import("./protocol.js").ImageHeader} ImageHeader
 * @typedef {{bitmap: ImageBitmap, limitPx: number | null}} Picture
 * @typedef {Map<string, Picture>} Pictures by layer and camera, see `keyOf`
 * @typedef {{header: ImageHeader, blob: Blob}} Arrived
 */

/**
 * @param {import("./protocol.js").PictureLayer} layer
 * @param {number} camera
 */
export function keyOf(layer, camera) {
  return `${layer} ${camera}`;
}

export class PictureAssembler {
  #onShow;
  /** @type {Arrived[]} of the incomplete set */
  #arriving = [];
  /** @type {{frame: number, pictures: Map<string, Arrived>} | null} complete sets of the newest frame that wait for decoding */
  #waiting = null;
  #decoding = false;
  #closed = false;

  /**
   * @param {(frame: number, pictures: Pictures) => void} onShow takes ownership of the bitmaps
   */
  constructor(onShow) {
    this.#onShow = onShow;
  }

  /**
   * Add a picture. An incomplete set is dropped when another set begins.
   *
   * @param {ImageHeader} header
   * @param {ArrayBuffer} payload
   */
  receive(header, payload) {
    if (this.#arriving[0]?.header.set !== header.set) this.#arriving = [];
    this.#arriving.push({ header, blob: new Blob([payload]) });
    if (this.#arriving.length < header.of) return;
    if (this.#waiting?.frame !== header.frame) this.#waiting = { frame: header.frame, pictures: new Map() };
    for (const one of this.#arriving) this.#waiting.pictures.set(keyOf(one.header.layer, one.header.camera), one);
    this.#arriving = [];
    void this.#decode();
  }

  /** Discard everything that is pending. */
  close() {
    this.#closed = true;
  }

  async #decode() {
    if (this.#decoding) return;
    this.#decoding = true;
    while (this.#waiting) {
      const { frame, pictures } = this.#waiting;
      this.#waiting = null;
      try {
        const decoded = await Promise.all(
          [...pictures].map(async ([key, { header, blob }]) => {
            const picture = { bitmap: await createImageBitmap(blob), limitPx: header.limit_px };
            return /** @type {[string, Picture]} */ ([key, picture]);
          }),
        );
        if (this.#closed) decoded.forEach(([, { bitmap }]) => bitmap.close());
        else this.#onShow(frame, new Map(decoded));
      } catch (error) {
        console.error(`frame ${frame}: a picture could not be decoded`, error);
      }
    }
    this.#decoding = false;
  }
}
