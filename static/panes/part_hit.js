/** Find the body part under the pointer. */

/**
 * The nearest part whose outline contains an image position; null if there is none.
 *
 * @param {import("../model/protocol.js").Overlay} overlay
 * @param {number} camera
 * @param {{u: number, v: number}} at
 * @param {(person: number) => boolean} isMeant whether a person's parts are included
 */
export function partAt(overlay, camera, { u, v }, isMeant) {
  /** @type {import("../model/protocol.js").Outline | null} */
  let nearest = null;
  for (const outline of overlay.outlines) {
    if (outline.camera !== camera || !isMeant(outline.person) || (nearest && nearest.depth <= outline.depth)) continue;
    if (holds(overlay.segments, outline, u, v)) nearest = outline;
  }
  return nearest;
}

/**
 * Whether a convex outline contains a position: it is on the same side of all segments.
 *
 * @param {Float32Array} segments
 * @param {import("../model/protocol.js").Outline} outline
 * @param {number} u
 * @param {number} v
 */
function holds(segments, { first, count }, u, v) {
  let side = 0;
  for (let i = 4 * first, end = 4 * (first + count); i < end; i += 4) {
    const [x0, y0, x1, y1] = segments.subarray(i, i + 4);
    const now = Math.sign((x1 - x0) * (v - y0) - (y1 - y0) * (u - x0));
    if (now !== 0 && side !== 0 && now !== side) return false;
    side = now || side;
  }
  return side !== 0;
}

/**
 * The outline of a part of a person in a view.
 *
 * @param {{outlines: import("../model/protocol.js").Outline[]}} overlay
 * @param {{camera: number, person: number, part: number}} meant
 */
export function outlineOf({ outlines }, { camera, person, part }) {
  return outlines.find((one) => one.camera === camera && one.person === person && one.part === part);
}

/**
 * Corners of an outline.
 *
 * @param {Float32Array} segments of the overlay
 * @param {import("../model/protocol.js").Outline} outline
 */
export function cornersOf(segments, { first, count }) {
  return Array.from({ length: count }, (_, i) => ({ u: segments[4 * (first + i)], v: segments[4 * (first + i) + 1] }));
}
