/** Cells of the timeline in columns. A long recording has 100,000 cells, which are drawn twice a second. */

/**
 * @typedef {import("./protocol.js").Cell} Cell
 * @typedef {import("./protocol.js").Status} Status
 */

/** How a pose was made, by its source. @type {Record<string, string>} */
export const SOURCE_WORDS = {
  manual: "by hand",
  pinned: "fitted to pins",
  searched: "searched on its frame",
  fitted: "fitted on its frame",
  tracked: "tracked",
  interpolated: "interpolated",
  smoothed: "smoothed",
  imported: "imported",
};
/** Sources in the order of the legend. timeline/cell_marks.js has their marks. */
export const SOURCES = Object.keys(SOURCE_WORDS);
/** Statuses of a pose, the worst last. */
export const STATUSES = /** @type {const} */ (["", "good", "doubtful", "lost"]);
const GOOD = STATUSES.indexOf("good");
/** Instead of a source: the frame has no pose. */
export const NO_POSE = 255;
export const KEYFRAME = 1;
export const REVIEWED = 2;
/** An alternative fits about as well, and nobody has confirmed this pose. */
export const AMBIGUOUS = 4;

/** Frames from one pose of a run to the next, at most: poses farther apart show no motion of a limb. */
const MAX_STRIDE = 10;

export class Cells {
  /** Number of frames that have a pose. */
  size = 0;
  /** @type {Map<number, string>} */
  #remarks = new Map();
  /** @type {Map<number, number[]>} */
  #limbsLost = new Map();

  /** @param {number} frames of the recording */
  constructor(frames) {
    /** Index into `SOURCES`, or `NO_POSE`. */
    this.sources = new Uint8Array(frames).fill(NO_POSE);
    /** Index into `STATUSES`. */
    this.statuses = new Uint8Array(frames);
    /** Bits `KEYFRAME`, `REVIEWED` and `AMBIGUOUS`. */
    this.marks = new Uint8Array(frames);
    /** Cost in pixels; NaN if unknown. */
    this.costs = new Float32Array(frames).fill(NaN);
  }

  /** Number of frames of the recording. */
  get frames() {
    return this.sources.length;
  }

  /** @param {number} frame */
  has(frame) {
    return frame >= 0 && frame < this.frames && this.sources[frame] !== NO_POSE;
  }

  /**
   * Frames around one as far as they have poses, at the distance of the nearest pose.
   *
   * @param {number} frame
   * @param {number} count of poses on either side, at most
   * @returns {{first: number, last: number}} `last` is included
   */
  around(frame, count) {
    let stride = 1;
    while (stride < MAX_STRIDE && !this.has(frame - stride) && !this.has(frame + stride)) stride += 1;
    const end = (/** @type {1 | -1} */ way) => {
      let found = frame;
      for (let i = 1; i <= count && this.has(frame + way * i * stride); i += 1) found = frame + way * i * stride;
      return found;
    };
    return { first: end(-1), last: end(1) };
  }

  /**
   * @param {number} frame
   * @returns {Cell | undefined}
   */
  get(frame) {
    if (!this.has(frame)) return undefined;
    const cost = this.costs[frame];
    return {
      source: SOURCES[this.sources[frame]],
      cost_px: cost === cost ? cost : null,
      keyframe: (this.marks[frame] & KEYFRAME) !== 0,
      status: STATUSES[this.statuses[frame]],
      remark: this.#remarks.get(frame) ?? "",
      reviewed: (this.marks[frame] & REVIEWED) !== 0,
      ambiguous: (this.marks[frame] & AMBIGUOUS) !== 0,
      limbs_lost: this.#limbsLost.get(frame) ?? [],
    };
  }

  /**
   * @param {number} frame
   * @param {Cell | null} cell null if the frame has no pose any more
   */
  set(frame, cell) {
    if (frame >= this.frames) return;
    this.#put(
      frame,
      cell ? Math.max(0, SOURCES.indexOf(cell.source)) : NO_POSE,
      cell ? STATUSES.indexOf(cell.status) : 0,
      cell ? (cell.keyframe ? KEYFRAME : 0) | (cell.reviewed ? REVIEWED : 0) | (cell.ambiguous ? AMBIGUOUS : 0) : 0,
      cell?.cost_px ?? NaN,
      cell?.remark ?? "",
      cell?.limbs_lost ?? [],
    );
  }

  /**
   * Copy cells that arrive in columns.
   *
   * @param {import("./protocol.js").CellsHeader} header
   * @param {ArrayBuffer} payload
   */
  take({ count, sources, statuses, remarks, limbs_lost }, payload) {
    const frames = new Uint32Array(payload, 0, count);
    const costs = new Float32Array(payload, 4 * count, count);
    const [source, status, marks] = [0, 1, 2].map((kind) => new Uint8Array(payload, (8 + kind) * count, count));
    const ownSource = sources.map((name) => Math.max(0, SOURCES.indexOf(name)));
    const ownStatus = statuses.map((name) => STATUSES.indexOf(name));
    for (let i = 0; i < count; i += 1) {
      if (frames[i] >= this.frames) continue;
      const of = source[i] === NO_POSE ? NO_POSE : ownSource[source[i]];
      this.#put(frames[i], of, ownStatus[status[i]], marks[i], costs[i], remarks[frames[i]] ?? "", limbs_lost[frames[i]] ?? []);
    }
  }

  /**
   * Probability that the likeliest limb is lost; 0 if unknown.
   *
   * @param {number} frame
   */
  worstLimb(frame) {
    return Math.max(0, ...(this.#limbsLost.get(frame) ?? []));
  }

  /** Frames that have a pose, and their cells. */
  *[Symbol.iterator]() {
    for (let frame = 0; frame < this.frames; frame += 1) {
      const cell = this.get(frame);
      if (cell) yield /** @type {[number, Cell]} */ ([frame, cell]);
    }
  }

  /**
   * @param {number} frame
   * @param {number} source
   * @param {number} status
   * @param {number} marks
   * @param {number} cost
   * @param {string} remark
   * @param {number[]} limbsLost
   */
  #put(frame, source, status, marks, cost, remark, limbsLost) {
    this.size += Number(source !== NO_POSE) - Number(this.sources[frame] !== NO_POSE);
    this.sources[frame] = source;
    this.statuses[frame] = status;
    this.marks[frame] = marks;
    this.costs[frame] = cost;
    if (remark) this.#remarks.set(frame, remark);
    else this.#remarks.delete(frame);
    if (limbsLost.length) this.#limbsLost.set(frame, limbsLost);
    else this.#limbsLost.delete(frame);
  }
}

/**
 * Frames that have a mark.
 *
 * @param {Cells} cells
 * @param {number} mark
 */
export function framesWith(cells, mark) {
  const found = [];
  for (let frame = 0; frame < cells.frames; frame += 1) if (cells.marks[frame] & mark) found.push(frame);
  return found;
}

/** @param {Cells} cells */
export function keyframesOf(cells) {
  return framesWith(cells, KEYFRAME);
}

/** Fewer good frames give no range of usual costs: a tenth of them must be a frame. */
const MIN_GOOD = 10;
/** So many cells are looked at, since a tracker changes cells twice a second. */
const MAX_LOOKED_AT = 2000;

/**
 * Costs between which the good frames lie, but for a tenth at each end.
 *
 * @param {Cells} cells
 * @returns {[number, number] | null} pixels; null before enough frames are good
 */
export function usualCosts(cells) {
  const costs = [];
  const step = Math.max(1, Math.floor(cells.frames / MAX_LOOKED_AT));
  for (let frame = 0; frame < cells.frames; frame += step) {
    if (cells.statuses[frame] === GOOD && Number.isFinite(cells.costs[frame])) costs.push(cells.costs[frame]);
  }
  if (costs.length < MIN_GOOD) return null;
  costs.sort((a, b) => a - b);
  const tenth = Math.floor(costs.length / 10);
  return [costs[tenth], costs[costs.length - 1 - tenth]];
}
