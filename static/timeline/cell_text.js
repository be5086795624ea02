/** Describe cells of the timeline in words. */

import { contradictions, keyframeDoubt } from "../model/keyframe_doubts.js";
import { differenceAt, earlierCalibration } from "../model/selectors.js";
import { displayName, percent, px } from "../widgets/text.js";

/**
 * @typedef {import("../model/protocol.js").Cell} Cell
 * @typedef {import("../model/protocol.js").PersonInfo} PersonInfo
 * @typedef {import("../model/protocol.js").SessionMessage} Session
 * @typedef {{name: string, lost: number, status: "doubtful" | "lost"}} DoubtfulLimb `lost`: the probability that it is lost
 */

/**
 * Limbs of a pose that may be lost, the likeliest first.
 *
 * @param {Cell} cell of one person
 * @param {PersonInfo} person
 * @param {Session} session
 * @returns {DoubtfulLimb[]}
 */
export function doubtfulLimbs({ limbs_lost }, { limbs }, { doubtful_from, lost_from }) {
  if (limbs_lost.length !== limbs.length) return []; // not assessed, or of another body
  return limbs
    .map((name, i) => ({ name, lost: limbs_lost[i], status: limbs_lost[i] > lost_from ? /** @type {const} */ ("lost") : /** @type {const} */ ("doubtful") }))
    .filter(({ lost }) => lost > doubtful_from)
    .sort((a, b) => b.lost - a.lost);
}

/**
 * As in "left arm: lost (97 % chance that it is lost); others tracked". Empty where the limbs were not assessed.
 *
 * @param {Cell} cell of one person
 * @param {PersonInfo} person
 * @param {Session} session
 */
export function describeLimbs(cell, person, session) {
  if (cell.limbs_lost.length !== person.limbs.length || person.limbs.length === 0) return "";
  const found = doubtfulLimbs(cell, person, session);
  if (found.length === 0) return "all limbs tracked";
  const parts = found.map(({ name, lost, status }, rank) => `${name}: ${status} (${percent(lost)}${rank > 0 ? "" : " chance that it is lost"})`);
  return [...parts, ...(found.length < person.limbs.length ? ["others tracked"] : [])].join("; ");
}

/**
 * Describe a frame: a line for all people, then one for each of several, then the limbs and the tracker's note.
 *
 * @param {number} frame
 * @param {import("../model/store.js").Facts} facts
 * @param {number | null} person of several people, the only one to describe; null for all
 * @returns {string[]} lines
 */
export function describeFrame(frame, facts, person = null) {
  return [...describePoses(frame, facts, person), ...describeTasks(frame, facts, person)];
}

/**
 * @param {number} frame
 * @param {import("../model/store.js").Facts} facts
 * @param {number | null} person
 */
function describeTasks(frame, { annotation, session }, person) {
  const own = annotation?.tasks.filter((task) => task.frame === frame && (person === null || task.person === person)) ?? [];
  const several = (session?.people.length ?? 1) > 1 && person === null;
  return own.map((task) => {
    const who = [several ? session?.people[task.person]?.name : "", task.annotator].filter(Boolean).join(", ");
    return `task${who ? ` of ${who}` : ""}: ${task.state}${task.comment ? `: ${task.comment}` : ""}`;
  });
}

/**
 * @param {number} frame
 * @param {import("../model/store.js").Facts} facts
 * @param {number | null} person
 * @returns {string[]} lines
 */
function describePoses(frame, facts, person) {
  const { timeline, lanes, session, disagreeing } = facts;
  const cell = timeline.get(frame);
  if (!cell || !session) return [`Frame ${frame}: no pose`];
  const doubts = (/** @type {number} */ one) => {
    const doubt = keyframeDoubt(facts, frame, one);
    return doubt ? contradictions(doubt, session).map((words) => `this keyframe disagrees ${words}`) : [];
  };
  const isNamed = session.people.some((_, one) => (keyframeDoubt(facts, frame, one)?.distance_cm ?? null) !== null);
  const earlier = (/** @type {number} */ one) => (earlierCalibration(facts)[one]?.has(frame) ? ["earlier calibration"] : []);
  const apart = (/** @type {number} */ one) => {
    const found = differenceAt(facts, one, frame);
    return found ? [`${facts.otherCopy?.name}: ${displayName(found.joint)} ${Math.round(found.distance_mm)} mm apart${found.decided ? ", decided" : ""}`] : [];
  };
  const jumps = disagreeing.includes(frame) && !isNamed ? ["inconsistent with its neighbours"] : [];
  if (lanes.length === 0) {
    return [`Frame ${frame}: ${summary(cell)}`, ...details(cell, session.people[0], session), ...doubts(0), ...earlier(0), ...apart(0), ...jumps];
  }
  const shown = person === null ? [...lanes.keys()] : [person];
  const lines = shown.flatMap((one) => {
    const own = lanes[one]?.get(frame);
    const info = session.people[one];
    return [`${info.name}: ${own ? summary(own) : "no pose"}`, ...(own ? details(own, info, session) : []), ...doubts(one), ...earlier(one), ...apart(one)];
  });
  return [person === null ? `Frame ${frame}: ${summary(cell)}` : `Frame ${frame}`, ...lines, ...jumps];
}

/** @param {Cell} cell */
function summary({ source, keyframe, status, cost_px, reviewed, ambiguous }) {
  const seen = keyframe ? "keyframe" : ambiguous ? "ambiguous" : reviewed && "reviewed";
  return [source, seen, status, px(cost_px)].filter(Boolean).join(", ");
}

/**
 * @param {Cell} cell of one person
 * @param {PersonInfo} person
 * @param {Session} session
 */
function details(cell, person, session) {
  return [describeLimbs(cell, person, session), cell.remark].filter(Boolean);
}
