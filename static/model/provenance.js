/** Where poses come from: words for it, and the filter of the timeline by it. */

import { KEYFRAME, NO_POSE, SOURCES, SOURCE_WORDS } from "./cells.js";
import { capital, displayName, percent } from "../widgets/text.js";

/**
 * @typedef {import("./protocol.js").ProvenanceMessage} Provenance
 * @typedef {import("./protocol.js").PointProvenance} PointProvenance
 * @typedef {{kind: "hand" | "fitted" | "tracked" | "interpolated" | "imported"} | {kind: "annotator", name: string}} Filter
 */

/** Choices of the filter, with the sources of poses that each lets through. @type {{kind: Exclude<Filter["kind"], "annotator">, label: string, sources: string[]}[]} */
export const KINDS = [
  { kind: "hand", label: "by hand", sources: ["manual", "pinned"] },
  { kind: "fitted", label: "searched or fitted", sources: ["searched", "fitted"] },
  { kind: "tracked", label: "tracked", sources: ["tracked", "smoothed"] },
  { kind: "interpolated", label: "interpolated", sources: ["interpolated"] },
  { kind: "imported", label: "imported", sources: ["imported"] },
];
const NOBODY = "nobody named";
/** Smallest probability that a limb is lost that is named: below, it is displayed as nothing. */
const LEAST_LOST = 0.01;
/** Sources that are somebody's own work, whose author and views are named. */
const BY_HAND = ["manual", "pinned"];
const WHEN = new Intl.DateTimeFormat("en-GB", { dateStyle: "medium", timeStyle: "short" });

/** @param {string} name of an annotator */
export function annotatorName(name) {
  return name || NOBODY;
}

/** @param {string} time ISO 8601 */
export function when(time) {
  const date = new Date(time);
  return Number.isNaN(date.getTime()) ? time : WHEN.format(date);
}

/**
 * Test of the frames of one person, or of all people together, that a filter lets through; null without a filter.
 *
 * @param {import("./store.js").Facts} facts
 * @param {number | null} person null for all people together
 * @returns {((frame: number) => boolean) | null}
 */
export function filterTest({ provenanceFilter: filter, annotators, timeline, lanes }, person) {
  if (!filter) return null;
  const cells = (person === null ? undefined : lanes[person]) ?? timeline;
  if (filter.kind === "annotator") {
    const people = person === null ? (annotators?.people ?? []) : [annotators?.people[person] ?? {}];
    const frames = new Set(people.flatMap((of) => of[filter.name] ?? []));
    return (frame) => frames.has(frame) && (cells.marks[frame] & KEYFRAME) !== 0;
  }
  const wanted = KINDS.find(({ kind }) => kind === filter.kind)?.sources.map((name) => SOURCES.indexOf(name)) ?? [];
  return (frame) => cells.sources[frame] !== NO_POSE && wanted.includes(cells.sources[frame]);
}

/**
 * How a point was placed, in phrases: "by hand by anna", "3 Mar 2026, 14:02", "in FRONT and LEFT".
 *
 * @param {PointProvenance} point
 * @param {Provenance} pose
 */
export function pointPhrases({ source, author, time, views, lost }, pose) {
  const isOwn = BY_HAND.includes(source);
  const isTaken = pose.taken_from !== "" && time === pose.time;
  const where = views.length ? `in ${listed(views)}` : "";
  const parts = isOwn ? [`${isTaken ? `taken from ${pose.taken_from}` : SOURCE_WORDS[source]} by ${annotatorName(author)}`, when(time), where] : [`${SOURCE_WORDS[source]}${how(source, pose)}`, where && `put by hand ${where}`];
  return [...parts, lost !== null && lost >= LEAST_LOST ? `${percent(lost)} chance that the limb is lost` : ""].filter(Boolean);
}

/**
 * By what a program made values of a source, as in " by contour from frames 15 and 30".
 *
 * @param {string} source
 * @param {Provenance} pose
 */
function how(source, { method, between, imported_from }) {
  if (source === "imported") return imported_from ? ` from ${imported_from}` : method ? ` from ${displayName(method)}` : "";
  const by = method && method !== "interpolate" ? ` by ${displayName(method)}` : "";
  return by + (between && ["tracked", "smoothed", "interpolated"].includes(source) ? ` from frames ${between[0]} and ${between[1]}` : "");
}

/**
 * Lines about the pose as a whole.
 *
 * @param {Provenance} pose with a source
 * @param {import("./protocol.js").TaskInfo[]} tasks of the person on its frame
 */
export function poseLines(pose, tasks) {
  const mark = pose.keyframe ? "Keyframe" : pose.reviewed ? "Reviewed" : "Stored";
  const verdict = tasks.find(({ state }) => state === "rejected") ?? tasks.find(({ state }) => state === "verified");
  return [
    `${mark} by ${annotatorName(pose.author)}, ${when(pose.time)}`,
    verdict && `${capital(verdict.state)} by ${annotatorName(verdict.by)}`,
    pose.taken_from && `Taken from ${pose.taken_from}`,
    capital(`${SOURCE_WORDS[pose.source ?? ""] ?? pose.source}${how(pose.source ?? "", pose)}`),
    pose.seam_mm === null ? "" : `Both passes lie up to ${Math.round(pose.seam_mm)} mm apart`,
    `Body ${pose.body}, revision ${pose.body_revision}${pose.is_earlier_body ? ": earlier than the present one" : ""}`,
    `Calibration revision ${pose.calibration_revision}${pose.is_earlier_calibration ? ": earlier than the present one" : ""}`,
    pose.program && `Program ${pose.program}`,
  ].filter((line) => typeof line === "string" && line !== "");
}

/**
 * The provenance of a joint of the shown pose in phrases; none where the page does not have it.
 *
 * @param {import("./store.js").Facts} facts
 * @param {{person: number, point: string}} joint
 */
export function provenanceOf({ provenance, state }, { person, point }) {
  if (!provenance || provenance.person !== person || provenance.frame !== state?.frame) return [];
  const found = provenance.points.find((one) => one.point === point);
  return found ? pointPhrases(found, provenance) : [];
}

/** @param {string[]} names */
function listed(names) {
  return names.length < 2 ? names.join("") : `${names.slice(0, -1).join(", ")} and ${names[names.length - 1]}`;
}
