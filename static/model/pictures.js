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

/** @typedef {ReturnType<typeof makePictureAssembler>} PictureAssembler */

/** @param {(frame: number, pictures: Pictures) => void} onShow takes ownership of the bitmaps */
export function makePictureAssembler(onShow) {
  /** @type {Arrived[]} of the incomplete set */
  let arriving = [];
  /** @type {{frame: number, pictures: Map<string, Arrived>} | null} complete sets of the newest frame that wait for decoding */
  let waiting = null;
  let decoding = false;
  let closed = false;

  /**
   * Add a picture. An incomplete set is dropped when another set begins.
   *
   * @param {ImageHeader} header
   * @param {ArrayBuffer} payload
   */
  function receive(header, payload) {
    if (arriving[0]?.header.set !== header.set) arriving = [];
    arriving.push({ header, blob: new Blob([payload]) });
    if (arriving.length < header.of) return;
    if (waiting?.frame !== header.frame) waiting = { frame: header.frame, pictures: new Map() };
    for (const one of arriving) waiting.pictures.set(keyOf(one.header.layer, one.header.camera), one);
    arriving = [];
    void decode();
  }

  /** Discard everything that is pending. */
  function close() {
    closed = true;
  }

  async function decode() {
    if (decoding) return;
    decoding = true;
    while (waiting) {
      const { frame, pictures } = waiting;
      waiting = null;
      try {
        const decoded = await Promise.all(
          [...pictures].map(async ([key, { header, blob }]) => {
            const picture = { bitmap: await createImageBitmap(blob), limitPx: header.limit_px };
            return /** @type {[string, Picture]} */ ([key, picture]);
          }),
        );
        if (closed) decoded.forEach(([, { bitmap }]) => bitmap.close());
        else onShow(frame, new Map(decoded));
      } catch (error) {
        console.error(`frame ${frame}: a picture could not be decoded`, error);
      }
    }
    decoding = false;
  }

  return { receive, close };
}
