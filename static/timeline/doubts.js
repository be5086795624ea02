/**
 * Queue of doubtful and lost poses: stretches of frames of one person, the most severe first. A pose that a person has
 * confirmed or reviewed is resolved.
 */

import { NO_POSE, REVIEWED, STATUSES } from "../model/cells.js";
import { doubtfulLimbs } from "./cell_text.js";

/**
 * @typedef {import("../model/cells.js").Cells} Cells
 * @typedef {object} Doubt a stretch of doubtful or lost poses of one person
 * @property {number} person
 * @property {number} first
 * @property {number} last
 * @property {number} worst the frame to look at first
 * @property {"doubtful" | "lost"} status the worst status
 * @property {import("./cell_text.js").DoubtfulLimb[]} limbs of the worst frame, the likeliest lost first
 * @property {number | null} limb index of the limb that is likeliest lost in the worst frame
 * @property {number} severity the status first, then the probability of a lost limb
 */

/** Number of frames without doubt within a stretch. More of them end it. */
const GAP = 3;
const DOUBT = STATUSES.indexOf("doubtful");

/**
 * List the unresolved doubts, the most severe first. A long stretch is listed in pieces of about a second around its worst
 * frames, because a correction helps that far.
 *
 * @param {import("../model/store.js").Facts} facts
 * @returns {Doubt[]}
 */
export function listDoubts({ timeline, lanes, session }) {
  if (!session) return [];
  const reach = Math.max(1, Math.round(session.fps / 2));
  const people = lanes.length > 0 ? lanes : [timeline];
  const found = people.flatMap((cells, person) =>
    cells ? stretches(cells).flatMap((span) => pieces(cells, span, reach)).map((span) => doubt(cells, person, span, session)) : [],
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
 * @param {number} frame
 */
function severityOf(cells, frame) {
  return isDoubt(cells, frame) ? cells.statuses[frame] + cells.worstLimb(frame) : 0;
}

/**
 * @param {Cells} cells
 * @returns {[number, number][]} first and last frame
 */
function stretches(cells) {
  /** @type {[number, number][]} */
  const found = [];
  for (let frame = 0; frame < cells.frames; frame += 1) {
    if (!isDoubt(cells, frame)) continue;
    const last = found.at(-1);
    if (last && frame - last[1] <= GAP + 1) last[1] = frame;
    else found.push([frame, frame]);
  }
  return found;
}

/**
 * Cut a stretch into pieces, each around its worst frame. A short rest stays with its neighbour.
 *
 * @param {Cells} cells
 * @param {[number, number]} span
 * @param {number} reach frames on either side of the worst one
 * @returns {[number, number][]}
 */
function pieces(cells, [first, last], reach) {
  const found = /** @type {[number, number][]} */ ([]);
  const waiting = [[first, last]];
  for (let span = waiting.pop(); span; span = waiting.pop()) {
    let [from, to] = span;
    while (from <= to && !isDoubt(cells, from)) from += 1;
    while (to >= from && !isDoubt(cells, to)) to -= 1;
    if (from > to) continue;
    const worst = worstOf(cells, from, to);
    const left = worst - reach - from >= reach ? worst - reach : from;
    const right = to - worst - reach >= reach ? worst + reach : to;
    found.push([left, right]);
    waiting.push([from, left - 1], [right + 1, to]);
  }
  return found;
}

/**
 * @param {Cells} cells
 * @param {number} first
 * @param {number} last
 */
function worstOf(cells, first, last) {
  let worst = first;
  for (let frame = first + 1; frame <= last; frame += 1) {
    if (severityOf(cells, frame) > severityOf(cells, worst)) worst = frame;
  }
  return worst;
}

/**
 * @param {Cells} cells
 * @param {number} person
 * @param {[number, number]} span
 * @param {import("../model/protocol.js").SessionMessage} session
 * @returns {Doubt}
 */
function doubt(cells, person, [first, last], session) {
  const worst = worstOf(cells, first, last);
  const cell = /** @type {import("../model/protocol.js").Cell} */ (cells.get(worst));
  const limbs = doubtfulLimbs(cell, session.people[person], session);
  const status = cell.status === "lost" ? "lost" : "doubtful";
  const limb = limbs.length ? session.people[person].limbs.indexOf(limbs[0].name) : null;
  return { person, first, last, worst, status, limbs, limb, severity: severityOf(cells, worst) };
}
