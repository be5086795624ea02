/** Samples of the marks of the timeline and of the lines over images, with their meanings. */

import { make } from "../widgets/elements.js";
import { sampleOf } from "../panes/pose_legend.js";
import { SOURCES } from "../model/cells.js";
import { STATUSES, diamondSwatch, earlierSwatch, sourceSwatch, statusSwatch, taskSwatch } from "./cell_marks.js";

/** @typedef {import("../model/protocol.js").Path["kind"]} Kind */

const STATUS_MEANINGS = { good: "good", doubtful: "doubtful: check it", lost: "lost" };
const SOURCE_MEANINGS = /** @type {Record<string, string>} */ ({
  manual: "manual: placed by hand",
  pinned: "pinned: fitted to pins",
  searched: "searched on its frame",
  fitted: "fitted on its frame",
  tracked: "tracked in a run",
  interpolated: "interpolated between poses",
  smoothed: "smoothed over a range",
  imported: "imported from a file",
});
const TASK_STATES = ["draft", "annotated", "verified", "rejected"];
/** @type {[Kind, "neutral" | "proposal" | "mark", string][]} */
const LINES = [
  ["candidate", "neutral", "pose under test"],
  ["compared", "neutral", "result of another run"],
  ["result", "neutral", "result, while the pose before is shown"],
  ["preview", "proposal", "candidate: click takes it"],
  ["alternative", "proposal", "alternative pose, which can be taken instead"],
  ["new_sizes", "proposal", "new body sizes: Apply takes them"],
  ["other_copy", "neutral", "pose of another copy: the section Other copy takes it"],
  ["former", "neutral", "limb before the fit, which can be taken back"],
  ["epipolar", "mark", "line of sight of a pin or drag"],
];

/** Section of the list of keys, and content of the legend's popover. */
export function markSection() {
  const rows = [
    ...STATUSES.map((status) => row(statusSwatch(status), STATUS_MEANINGS[status])),
    row(diamondSwatch(), "keyframe; larger with an exclamation mark: check it"),
    ...SOURCES.map((source) => row(sourceSwatch(source), SOURCE_MEANINGS[source])),
    row(earlierSwatch(), "of an earlier calibration"),
    row(make("span", "task-samples", ...TASK_STATES.map(taskSwatch)), `task: ${TASK_STATES.join(", ")}`),
    ...LINES.map(([kind, color, meaning]) => row(sampleOf(kind, `var(--image-${color})`), meaning)),
  ];
  return make("section", "mark-list", make("h3", {}, "Marks and lines"), make("dl", {}, ...rows));
}

/**
 * @param {Element} mark
 * @param {string} meaning
 */
function row(mark, meaning) {
  return make("div", {}, make("dt", {}, mark), make("dd", {}, meaning));
}
