/** Where poses come from: words for it, and the filter of the timeline by it. */

import { KEYFRAME, NO_POSE, SOURCES } from "./cells.js";
import { displayName, percent } from "../widgets/text.js";

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
const WORDS = /** @type {Record<string, string>} */ ({
  manual: "by hand",
  pinned: "fitted to pins",
  searched: "searched on its frame",
  fitted: "fitted on its frame",
  tracked: "tracked",
  interpolated: "interpolated",
  smoothed: "smoothed",
  imported: "imported",
});
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

/** @param {Filter} filter */
export function filterLabel(filter) {
  if (filter.kind === "annotator") return `keyframes of ${annotatorName(filter.name)}`;
  return KINDS.find(({ kind }) => kind === filter.kind)?.label ?? "";
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
 * How a point was placed, as in "by hand by anna, 3 Mar 2026, 14:02, in FRONT and LEFT".
 *
 * @param {PointProvenance} point
 * @param {Provenance} pose
 */
export function pointText({ source, author, time, views, lost }, pose) {
  const isOwn = BY_HAND.includes(source);
  const where = views.length ? `in ${listed(views)}` : "";
  const parts = isOwn ? [`${WORDS[source]} by ${annotatorName(author)}`, when(time), where] : [`${WORDS[source]}${how(source, pose)}`, where && `put by hand ${where}`];
  return [...parts, lost ? `${percent(lost)} lost` : ""].filter(Boolean).join(", ");
}

/**
 * By what a program made values of a source, as in " by contour from keyframes 15 and 30".
 *
 * @param {string} source
 * @param {Provenance} pose
 */
function how(source, { method, between, imported_from }) {
  if (source === "imported") return imported_from ? ` from ${imported_from}` : method ? ` from ${displayName(method)}` : "";
  const by = method && method !== "interpolate" ? ` by ${displayName(method)}` : "";
  return by + (between && ["tracked", "smoothed", "interpolated"].includes(source) ? ` from keyframes ${between[0]} and ${between[1]}` : "");
}

/**
 * Lines about the pose as a whole.
 *
 * @param {Provenance} pose with a source
 */
export function poseLines(pose) {
  const mark = pose.keyframe ? "Keyframe" : pose.reviewed ? "Reviewed" : "Stored";
  return [
    `${mark} by ${annotatorName(pose.author)}, ${when(pose.time)}`,
    pose.taken_from && `Taken from ${pose.taken_from}`,
    `Most manual source: ${WORDS[pose.source ?? ""] ?? pose.source}${how(pose.source ?? "", pose)}`,
    pose.seam_mm === null ? "" : `Both passes lie up to ${Math.round(pose.seam_mm)} mm apart`,
    `Body ${pose.body}, revision ${pose.body_revision}${pose.is_earlier_body ? ": earlier than the present one" : ""}`,
    `Calibration revision ${pose.calibration_revision}${pose.is_earlier_calibration ? ": earlier than the present one" : ""}`,
    pose.program && `Program ${pose.program}`,
  ].filter(Boolean);
}

/**
 * The provenance of a joint of the shown pose, if the page has it.
 *
 * @param {import("./store.js").Facts} facts
 * @param {{person: number, point: string}} joint
 */
export function provenanceOf({ provenance, state }, { person, point }) {
  if (!provenance || provenance.person !== person || provenance.frame !== state?.frame) return "";
  const found = provenance.points.find((one) => one.point === point);
  return found ? pointText(found, provenance) : "";
}

/** @param {string[]} names */
function listed(names) {
  return names.length < 2 ? names.join("") : `${names.slice(0, -1).join(", ")} and ${names[names.length - 1]}`;
}
