/** The table of a batch: a row for each recording, the one that needs a person most first. */

import { make, makeTable } from "../widgets/elements.js";

/**
 * @typedef {{name: string, session: string, state: string, expected_error_mm: number | null, share_doubted: number,
 *   poses: number, verified: number, worst_frame: number | null, worst_person: string, seconds: number,
 *   contradiction: string, error: string, joined?: string}} BatchRow
 * @typedef {{done: number, failed: number, running: number, waiting: number, hours: number, share_verified: number}} Totals
 * @typedef {{name: string, totals: Totals, recordings: BatchRow[]}} Batch
 */

const HEADS = [["Recording"], ["Error, mm"], ["Doubted"], ["Verified"], ["Seconds"]];
const STATES = /** @type {const} */ (["done", "failed", "running", "waiting"]);

/**
 * Make the table of a batch.
 *
 * @param {Batch} batch
 * @param {(folder: string, at: {frame: number, person: string}) => void} open opens a session at its worst frame
 */
export function batchTable({ name, totals, recordings }, open) {
  const counts = STATES.filter((state) => totals[state]).map((state) => `${totals[state]} ${state}`);
  const verified = `${Math.round(100 * totals.share_verified)}% verified, ${totals.hours.toFixed(1)} hours of workers`;
  const summary = make("summary", {}, make("b", {}, name), ` ${counts.join(", ")}; ${verified}`);
  const rows = recordings.map((row) => rowOf(row, open));
  return make("details", "batch", summary, makeTable("", HEADS, rows));
}

/**
 * @param {BatchRow} row
 * @param {(folder: string, at: {frame: number, person: string}) => void} open
 */
function rowOf(row, open) {
  const first = make("td");
  if (row.state === "done") {
    const at = { frame: row.worst_frame ?? 0, person: row.worst_person };
    const title = `Close this session and open ${row.name} at frame ${at.frame}, where it is worst`;
    first.append(make("button", { type: "button", title, onclick: () => open(row.session, at) }, row.name));
  } else {
    first.append(row.name);
  }
  const note = row.error || row.contradiction || (row.joined ?? "");
  if (note) first.append(make("small", row.error && "is-failed", note));
  const isTracked = row.poses > 0;
  const cells = [
    row.expected_error_mm === null ? row.state.replace("done", "") : row.expected_error_mm.toFixed(1),
    isTracked ? `${Math.round(100 * row.share_doubted)}%` : "",
    isTracked ? `${row.verified}/${row.poses}` : "",
    row.seconds ? row.seconds.toFixed(0) : "",
  ];
  return make("tr", {}, first, ...cells.map((text) => make("td", {}, text)));
}
