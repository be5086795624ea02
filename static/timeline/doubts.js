/**
 * Queue of doubtful and lost poses and of doubted keyframes, the most severe first. Doubts of one cause are one entry: the same
 * limb of a person within a second, or the neighbours of a keyframe that they contradict. A pose that a person has confirmed
 * or reviewed is resolved.
 */

import { NO_POSE, REVIEWED, STATUSES } from "../model/cells.js";
import { doubtfulLimbs } from "./cell_text.js";

/**
 * @typedef {import("../model/cells.js").Cells} Cells
 * @typedef {import("../model/protocol.js").KeyframeDoubt} KeyframeDoubt
 * @typedef {{first: number, last: number}} Span frames, `last` included
 * @typedef {object} Doubt doubtful or lost poses of one person that have one cause
 * @property {number} person
 * @property {number} first
 * @property {number} last
 * @property {Span[]} spans stretches of poses in doubt
 * @property {number} worst the frame to look at first
 * @property {"doubtful" | "lost" | "keyframe"} status the worst status
 * @property {import("./cell_text.js").DoubtfulLimb[]} limbs of the worst frame, the likeliest lost first
 * @property {number | null} limb index of the limb that is likeliest lost in the worst frame
 * @property {KeyframeDoubt | null} keyframe the keyframe that is the cause
 * @property {number} severity the status first, then the probability of a lost limb; a keyframe comes before all
 */

/** Number of frames without doubt within a stretch, and beside a keyframe. More of them end it. */
const GAP = 3;
const DOUBT = STATUSES.indexOf("doubtful");

/**
 * List the unresolved doubts, the most severe first.
 *
 * @param {import("../model/store.js").Facts} facts
 * @returns {Doubt[]}
 */
export function listDoubts({ timeline, lanes, session, keyframeDoubts }) {
  if (!session) return [];
  const people = lanes.length > 0 ? lanes : [timeline];
  const found = people.flatMap((cells, person) =>
    cells ? doubtsOf(cells, person, session, keyframeDoubts.filter((one) => one.person === person)) : [],
  );
  return found.sort((a, b) => b.severity - a.severity || b.last - b.first - (a.last - a.first) || a.worst - b.worst);
}

/**
 * Number of doubtful and lost poses, and how many of them are resolved.
 *
 * @param {import("../model/store.js").Facts} facts
 */
export function countDoubts({ timeline, lanes }) {
  let [all, resolved] = [0, 0];
  for (const { statuses, marks } of lanes.length > 0 ? lanes : [timeline]) {
    for (let frame = 0; frame < statuses.length; frame += 1) {
      if (statuses[frame] < DOUBT) continue;
      all += 1;
      if (marks[frame] & REVIEWED) resolved += 1;
    }
  }
  return { all, resolved };
}

/**
 * @param {Cells} cells
 * @param {number} frame
 */
function isDoubt({ sources, statuses, marks }, frame) {
  return statuses[frame] >= DOUBT && sources[frame] !== NO_POSE && !(marks[frame] & REVIEWED);
}

/**
 * @param {Cells} cells
 * @param {number} person
 * @param {import("../model/protocol.js").SessionMessage} session
 * @param {KeyframeDoubt[]} keyframes
 * @returns {Doubt[]}
 */
function doubtsOf(cells, person, session, keyframes) {
  const found = keyframes.map((keyframe) => ofKeyframe(keyframe, cells, session));
  /** @type {Map<string, Doubt>} the last entry of each cause */
  const open = new Map();
  for (let frame = 0; frame < cells.frames; frame += 1) {
    if (!isDoubt(cells, frame)) continue;
    const cell = /** @type {import("../model/protocol.js").Cell} */ (cells.get(frame));
    const limbs = doubtfulLimbs(cell, session.people[person], session);
    const severity = cells.statuses[frame] + cells.worstLimb(frame);
    const cause = limbs[0]?.name ?? cell.remark;
    const beside = found.find(({ keyframe }) => keyframe !== null && keyframe.distance_cm !== null && Math.abs(keyframe.frame - frame) <= GAP);
    const last = beside ?? open.get(cause);
    if (last && (beside || frame - last.last <= Math.max(session.fps, GAP + 1))) {
      addFrame(last, frame);
      if (severity <= last.severity) continue;
      Object.assign(last, { worst: frame, severity, limbs, limb: limbOf(limbs, person, session), status: statusOf(cell) });
      continue;
    }
    const limb = limbOf(limbs, person, session);
    const spans = [{ first: frame, last: frame }];
    const doubt = { person, first: frame, last: frame, spans, worst: frame, status: statusOf(cell), limbs, limb, keyframe: null, severity };
    open.set(cause, doubt);
    found.push(doubt);
  }
  return found;
}

/**
 * @param {KeyframeDoubt} keyframe
 * @param {Cells} cells of its person
 * @param {import("../model/protocol.js").SessionMessage} session
 * @returns {Doubt}
 */
function ofKeyframe(keyframe, cells, session) {
  const { person, frame } = keyframe;
  const cell = keyframe.reason ? cells.get(frame) : null;
  const limbs = cell ? doubtfulLimbs(cell, session.people[person], session) : [];
  const limb = limbOf(limbs, person, session);
  return { person, first: frame, last: frame, spans: [], worst: frame, status: "keyframe", limbs, limb, keyframe, severity: Infinity };
}

/**
 * @param {Doubt} doubt
 * @param {number} frame
 */
function addFrame(doubt, frame) {
  const span = doubt.spans.at(-1);
  if (span && frame - span.last <= GAP + 1) span.last = frame;
  else doubt.spans.push({ first: frame, last: frame });
  doubt.first = Math.min(doubt.first, frame);
  doubt.last = Math.max(doubt.last, frame);
}

/**
 * @param {import("./cell_text.js").DoubtfulLimb[]} limbs
 * @param {number} person
 * @param {import("../model/protocol.js").SessionMessage} session
 */
function limbOf(limbs, person, session) {
  return limbs.length ? session.people[person].limbs.indexOf(limbs[0].name) : null;
}

/**
 * @param {import("../model/protocol.js").Cell} cell
 * @returns {"lost" | "doubtful"}
 */
function statusOf(cell) {
  return cell.status === "lost" ? "lost" : "doubtful";
}
