/** Convert messages about searches to facts of the store. */

/**
 * @typedef {{count: number, evaluations: Float32Array, tested: Float32Array, best: Float32Array,
 *   stages: Float32Array}} Steps columns of the recorded steps of a run: poses evaluated so far, costs in px, index of the stage
 * @typedef {{costs: (number | null)[], clearest_view: number, people: number[], cameras: number,
 *   points: Float32Array}} Candidates costs in px; points are those of each candidate, in each view, u and v
 * @typedef {import("./protocol.js").LandscapeHeader & {values: Float32Array, total: Float32Array,
 *   views: Float32Array[]}} Landscape
 */

/**
 * @param {import("./store.js").Facts} facts
 * @param {import("./protocol.js").SearchRunsMessage} message
 * @returns {Partial<import("./store.js").Facts>}
 */
export function takeRuns(facts, message) {
  const newest = message.runs.at(-1)?.number ?? 0;
  const known = facts.searchRuns?.runs.at(-1)?.number ?? 0;
  const isKept = message.runs.some(({ number }) => number === facts.searchRun);
  // Select a new run.
  const searchRun = newest > known || !isKept ? null : facts.searchRun;
  const searchSteps = keptOf(facts.searchSteps, message);
  const searchCandidates = keptOf(facts.searchCandidates, message);
  return { searchRuns: message, searchRun, searchSteps, searchCandidates };
}

/**
 * Keep the data of listed runs only, so that memory stays bounded.
 *
 * @template T
 * @param {Map<number, T>} known by run
 * @param {import("./protocol.js").SearchRunsMessage} message
 */
function keptOf(known, { runs }) {
  const kept = [...known].filter(([run]) => runs.some(({ number }) => number === run));
  return kept.length === known.size ? known : new Map(kept);
}

/**
 * The run that the user has selected, by default the newest.
 *
 * @param {import("./store.js").Facts} facts
 */
export function selectedRun(facts) {
  const runs = facts.searchRuns?.runs ?? [];
  return runs.find(({ number }) => number === facts.searchRun) ?? runs.at(-1) ?? null;
}

/**
 * @param {Map<number, Steps>} known
 * @param {import("./protocol.js").SearchStepsHeader} header
 * @param {ArrayBuffer} payload
 */
export function mergeSteps(known, { run, first, count }, payload) {
  const columns = new Float32Array(payload);
  const before = known.get(run);
  const join = (/** @type {number} */ index, /** @type {Float32Array | undefined} */ previous) => {
    const out = new Float32Array(first + count);
    if (previous) out.set(previous.subarray(0, first));
    out.set(columns.subarray(index * count, (index + 1) * count), first);
    return out;
  };
  return new Map(known).set(run, {
    count: first + count,
    evaluations: join(0, before?.evaluations),
    tested: join(1, before?.tested),
    best: join(2, before?.best),
    stages: join(3, before?.stages),
  });
}

/**
 * @param {Map<number, Candidates>} known
 * @param {import("./protocol.js").SearchCandidatesHeader} header
 * @param {ArrayBuffer} payload
 */
export function mergeCandidates(known, { run, costs_px, points, clearest_view }, payload) {
  const values = new Float32Array(payload);
  const each = 2 * points.reduce((sum, n) => sum + n, 0);
  const cameras = costs_px.length ? values.length / (each * costs_px.length) : 0;
  return new Map(known).set(run, { costs: costs_px, clearest_view, people: points, cameras, points: values });
}

/**
 * @param {import("./protocol.js").LandscapeHeader} header
 * @param {ArrayBuffer} payload
 * @returns {Landscape}
 */
export function takeLandscape(header, payload) {
  const all = new Float32Array(payload);
  const rows = Array.from({ length: all.length / header.count }, (_, i) =>
    all.subarray(i * header.count, (i + 1) * header.count),
  );
  return { ...header, values: rows[0], total: rows[1], views: rows.slice(2) };
}
