/**
 * The shared stretch: data.js of the folder sets it before this script runs (app/share/content.py).
 *
 * @typedef {{ name: string, width: number, height: number, center: number[], corners: number[][] }} Camera
 * Centre and directions of the corners in the world, metres.
 *
 * @typedef {object} Pose
 * @property {number} figure index of its bones
 * @property {number[]} points x, y, z one after the other, mm
 * @property {"" | "good" | "doubtful" | "lost"} status
 * @property {string} source
 * @property {boolean} keyframe
 * @property {boolean} reviewed
 * @property {string} remark
 * @property {string} time ISO 8601
 * @property {string} program
 * @property {number} calibration
 * @property {string} body
 *
 * @typedef {{ title: string, unit: string, labels: string[], values: (number | null)[][] }} Plot
 *
 * @typedef {object} Person
 * @property {number} index in the session
 * @property {string} name
 * @property {string} color
 * @property {number[][][]} figures bones of each body, pairs of indices of points
 * @property {Record<string, Pose>} poses by frame
 * @property {Plot[]} plots
 *
 * @typedef {{ person: number, visible: number[][], hidden: number[][], points: (number | null)[] }} Lines
 * Polylines u, v, du, dv, ... and points u, v, ... over a picture, in `units_per_px`.
 *
 * @typedef {{ person: string, frame: number, limb: string, text: string, author: string, resolved: boolean }} Comment
 *
 * @typedef {object} Share
 * @property {string} session
 * @property {string} program
 * @property {number} fps
 * @property {number[]} frames
 * @property {string} calibration
 * @property {{ normal: number[], offset: number }} floor
 * @property {Camera[]} cameras
 * @property {Person[]} people
 * @property {Comment[]} comments
 * @property {string[][]} pictures addresses by view and frame
 * @property {Lines[][][]} lines by frame, view and person
 * @property {number} units_per_px
 */

export const data = /** @type {Share} */ (Reflect.get(globalThis, "quadrilleShare"));

/**
 * Return the pose of a person in a frame of the stretch.
 *
 * @param {Person} person
 * @param {number} at index of the frame
 * @returns {Pose | undefined}
 */
export const poseOf = (person, at) => person.poses[String(data.frames[at])];
