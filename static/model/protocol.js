/**
 * The messages of the pane socket (docs/protocol.md). Positions are undistorted pixels, pixel centres at integers.
 *
 * @typedef {"image" | "silhouette" | "distance" | "parts"} PictureLayer
 * @typedef {PictureLayer | "accepted" | "rejected" | "contours" | "hidden" | "part_edges" | "skeleton" | "joints" |
 *   "epipolar"} Layer
 * @typedef {{name: string, width: number, height: number}} CameraInfo
 * @typedef {{name: string, color: string, model: string, height_m: number, points: string[], minor: string[], bones: [string, string][],
 *   parts: string[], dofs: DofInfo[], point_dofs: Record<string, number[]>,
 *   point_limbs: Record<string, {name: string, dofs: number[]}>}} PersonInfo
 * @typedef {{joint: string, name: string, unit: "deg" | "cm", low: number | null, high: number | null}} DofInfo
 * @typedef {{type: "session", name: string, fps: number, n_frames: number, cameras: CameraInfo[],
 *   people: PersonInfo[]}} SessionMessage
 * @typedef {{running: boolean, kind: string | null, stage: string | null, stages: string[], evaluations: number,
 *   per_second: number, best_px: number | null, message: string}} Job
 * @typedef {"" | "good" | "doubtful" | "lost"} Status
 * @typedef {{running: boolean, first: number | null, last: number | null, at: number | null, done: number, total: number,
 *   per_second: number, doubtful: number, lost: number, back: boolean, message: string}} Track
 * @typedef {{running: boolean, what: string, done: number, total: number, message: string}} RangeWork
 * @typedef {"track_forward" | "track_backward" | "interpolate" | "clear" | "keyframe" | "reviewed" | "unreviewed" |
 *   "none"} RangeAction
 * @typedef {{point: number, views: number, marked: boolean, known: boolean, error_px: number | null, ready: boolean,
 *   why: string}} FloorPicking
 * @typedef {{source: string | null, status: Status, shown: boolean, alternatives: number}} PersonState
 * @typedef {{type: "state", frame: number, person: number, point: string | null, people: PersonState[], solo: boolean,
 *   cost_px: number | null, view_costs_px: (number | null)[], source: string | null, status: Status, remark: string,
 *   part_costs_px: (number | null)[], dofs: number[], locked: number[], other_sizes: boolean, job: Job, track: Track, range: RangeWork,
 *   replay: {run: number, step: number, steps: number, stage: string | null} | null, follow: boolean, snapped: number | null,
 *   floor: FloorPicking | null, footage: {listed: number | null, error: string | null}, compiling: boolean,
 *   undo: string | null, redo: string | null,
 *   saved: boolean, save_error: string | null}} StateMessage
 * @typedef {{edit: number, label: string, author: string, time: string, undone: boolean}} HistoryEntry
 * @typedef {{type: "history", entries: HistoryEntry[], later: boolean, earlier: boolean}} HistoryMessage
 * @typedef {{type: "notice", level: "error" | "info", text: string}} NoticeMessage
 * @typedef {{source: string, cost_px: number | null, keyframe: boolean, status: Status, remark: string,
 *   reviewed: boolean, ambiguous: boolean}} Cell
 * @typedef {{type: "timeline", person: number | null, cells: Record<string, Cell | null>, replace: boolean}} TimelineMessage
 * @typedef {{person: number, name: string, dofs: string[], bound_rad: number | null, step_rad: number | null,
 *   bound_m: number | null, step_m: number | null, angles: number, lengths: number, own: boolean}} SearchLeaf
 * @typedef {{type: "search_setup", theta_px: number | null, outliers: "truncated" | "paper", passes: number[],
 *   patience: number, max_expansions: number, limbs_apart: boolean, bound_rad: number, bound_m: number, step_rad: number,
 *   step_m: number, speed: number | null, leaves: SearchLeaf[]}} SearchSetupMessage
 * @typedef {{person: number, name: string, factor: number, evaluations: number, gain_px: number, done: boolean,
 *   running: boolean}} SearchStage
 * @typedef {{number: number, state: "running" | "paused" | "over", start_px: number | null, best_px: number | null,
 *   evaluations: number, seconds: number, steps: number, thinned: number, differs: Record<string, string>,
 *   stages: SearchStage[]}} SearchRun
 * @typedef {{run: number, step: number, stage: string | null, candidate_px: number | null, best_px: number | null,
 *   evaluations: number}} Replay
 * @typedef {{type: "search_runs", runs: SearchRun[], replay: Replay | null, compared: number | null}} SearchRunsMessage
 * @typedef {SessionMessage | StateMessage | HistoryMessage | NoticeMessage | TimelineMessage | SearchSetupMessage |
 *   SearchRunsMessage | InconsistentMessage} TextMessage
 * @typedef {{type: "inconsistent", frames: number[]}} InconsistentMessage
 *
 * @typedef {{type: "image", layer: PictureLayer, camera: number, frame: number, set: number, of: number,
 *   limit_px: number | null}} ImageHeader
 * @typedef {{camera: number, person: number, color: string, first: number, count: number,
 *   kind: "model" | "hidden" | "candidate" | "ghost" | "part_edge" | "epipolar" | "accepted" | "rejected" |
 *   "floor"}} Path
 * @typedef {{camera: number, person: number, part: number, depth: number, first: number, count: number}} Outline
 * @typedef {{camera: number, person: number, point: string, u: number, v: number, visible: boolean}} Handle
 * @typedef {{camera: number, person: number, point: string, u: number, v: number, model_u: number | null,
 *   model_v: number | null}} PinMark
 * @typedef {{person: number, point: string, pins: number, error_px: number | null, why: string,
 *   marks: {camera: number, u: number, v: number, error_px: number | null}[]}} PinTriangulation
 * @typedef {{type: "overlay", frame: number, seq: number, job: boolean, paths: Path[], outlines: Outline[],
 *   handles: Handle[], pins: PinMark[], triangulation: PinTriangulation | null}} OverlayHeader
 * @typedef {OverlayHeader & {segments: Float32Array}} Overlay
 * @typedef {"arms" | "torso" | "legs" | "cost"} CurveGroup
 * @typedef {{title: string, unit: "deg" | "cm" | "px", labels: string[]}} Plot
 * @typedef {{type: "curves", group: CurveGroup, person: number, replace: boolean, count: number,
 *   plots: Plot[]}} CurvesHeader
 * @typedef {{type: "search_steps", run: number, first: number, count: number}} SearchStepsHeader
 * @typedef {{type: "search_candidates", run: number, costs_px: (number | null)[], points: number[],
 *   clearest_view: number}} SearchCandidatesHeader
 * @typedef {{type: "landscape", person: number, dof: number, names: string[], unit: "rad" | "m", current: number,
 *   current_px: number | null, count: number}} LandscapeHeader
 * @typedef {ImageHeader | OverlayHeader | CurvesHeader | SearchStepsHeader | SearchCandidatesHeader |
 *   LandscapeHeader | CellsHeader} BinaryHeader
 * @typedef {{type: "cells", person: number | null, replace: boolean, count: number, sources: string[], statuses: Status[],
 *   remarks: Record<string, string>}} CellsHeader
 *
 * @typedef {"move" | "turn" | "push"} DragMode
 * @typedef {{type: "pose", frame: number, person: number} & (
 *   {action: "set", dof: number, value: number} | {action: "turn", dof: number, by: number} |
 *   {action: "nudge", point: string | null, camera: number, right: number, up: number} |
 *   {action: "mirror" | "alternative"} | {action: "copy" | "copy_person", from: number} | {action: "reset", point: string | null} |
 *   {action: "lock", dofs: number[], locked: boolean})} PoseEdit
 * @typedef {{type: "seek", frame: number} |
 *   {type: "select", person: number, point: string | null} |
 *   {type: "drag", phase: "start" | "move" | "end" | "cancel", frame: number, camera: number, person: number,
 *     point: string, part: number | null, mode: DragMode, u: number, v: number, seq: number} |
 *   PoseEdit |
 *   {type: "view", layers: Layer[], reductions: number[], by_part: boolean} |
 *   {type: "search", action: "step" | "stage" | "frame" | "stop", person: number | null} |
 *   {type: "search", action: "again", run: number | null, person: number | null} |
 *   {type: "people", action: "show", person: number, shown: boolean} | {type: "people", action: "solo", on: boolean} |
 *   {type: "search_speed", per_second: number | null} |
 *   {type: "search_settings", changes: Record<string, unknown>} |
 *   {type: "watch", tab: "search" | "landscape" | null} |
 *   {type: "replay", run: number | null, step: number} |
 *   {type: "compare", run: number | null} |
 *   {type: "preview", run: number, candidate: number | null} |
 *   {type: "take", run: number, candidate: number | null} |
 *   {type: "landscape", dof: string} |
 *   {type: "landscape_set", person: number, dof: number, value: number} |
 *   {type: "pin", phase: "start" | "move" | "end" | "cancel", frame: number, camera: number, person: number,
 *     point: string, u: number, v: number, live: boolean} |
 *   {type: "unpin", frame: number, person: number, point: string | null, camera: number | null} |
 *   {type: "fit", frame: number, person: number | null} |
 *   {type: "track", action: "forward" | "backward", until: number | null} |
 *   {type: "track", action: "pause" | "resume" | "stop"} |
 *   {type: "range", action: RangeAction, first: number, last: number, person: number | null} |
 *   {type: "stop_range"} |
 *   {type: "mark", toggle: "keyframe" | "reviewed"} |
 *   {type: "follow", follow: boolean} |
 *   {type: "curves", group: CurveGroup | null} |
 *   {type: "pause_3d", pause: boolean} |
 *   {type: "snap", camera: number | null} |
 *   {type: "floor", action: "begin" | "next" | "take_back" | "apply" | "cancel" | "revert"} |
 *   {type: "floor", action: "mark", camera: number, u: number, v: number} |
 *   {type: "history", limit: number} |
 *   {type: "go_to", edit: number | null} |
 *   {type: "save"} |
 *   {type: "undo"} | {type: "redo"}} ClientMessage
 */

const decoder = new TextDecoder();

/**
 * Take a binary message apart: `[uint32 LE header length][header JSON][payload]`.
 *
 * @param {ArrayBuffer} buffer
 * @returns {{header: BinaryHeader, payload: ArrayBuffer}}
 */
export function decodeBinary(buffer) {
  const headerLength = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(decoder.decode(new Uint8Array(buffer, 4, headerLength)));
  return { header, payload: buffer.slice(4 + headerLength) };
}
