/**
 * List of all long work under way, in one place over the 3-D view: what is done, how long the rest takes, and Stop. A search
 * for people that has failed stays in it until it is closed.
 */

import { hasTrack } from "../model/selectors.js";
import { button, byId, make } from "../widgets/elements.js";
import { capital, count, displayName, percent } from "../widgets/text.js";
import { TimeLeft, timeText } from "../widgets/time_left.js";

/**
 * @typedef {import("../model/store.js").Facts} Facts
 * @typedef {object} Work
 * @property {string} id
 * @property {string} text what is being done
 * @property {string} done how much of it is done, for people to read
 * @property {number | null} share of it that is done; null if unknown
 * @property {string} [title] tooltip
 * @property {(() => void) | null} stop null for what ends by itself
 *
 * @typedef {{row: HTMLElement, text: HTMLElement, figures: HTMLElement, bar: HTMLProgressElement, stop: HTMLButtonElement,
 *   left: TimeLeft, work: Work}} Shown
 */

const TICK_MS = 1000;
const COMPILING =
  "The numerical kernels are compiled once after installation, which takes a minute or two. Until its kernels are compiled, the body is " +
  "drawn as a skeleton and has no cost. A search or tracking run waits for the kernels that it needs.";
const INDEXING = "The footage is indexed when it is first opened. Frames can be shown as soon as they are indexed.";

/**
 * @param {import("../model/index.js").Context} context
 * @param {() => void} cancelExport
 */
export function mountWorkList({ store, send, navigation, layers, actions, notify }, cancelExport) {
  const list = byId("work", HTMLElement);
  /** @type {Map<string, Shown>} */
  const rows = new Map();
  const failure = byId("find-failure", HTMLElement);
  const damage = byId("damage", HTMLElement);
  /** Whether the silhouettes are shown for the failure only. */
  let hasSilhouettes = false;
  let wasFinding = false;
  button("failure-look", () => lookAtSilhouettes());
  button("failure-place", () => placeByHand());
  button("failure-close", () => closeFailure());
  store.on(["session"], () => (failure.hidden = true));
  store.on(["finding"], watchFinding);
  store.on(["state", "finding", "acquisition", "connected", "exporting"], show);
  store.on(["state"], showDamage);
  setInterval(() => rows.size > 0 && showFigures(), TICK_MS);

  function show() {
    const all = store.facts.connected ? listWork() : [];
    for (const [id, { row }] of rows) {
      if (all.some((work) => work.id === id)) continue;
      row.remove();
      rows.delete(id);
    }
    for (const work of all) {
      const shown = rows.get(work.id) ?? add(work);
      shown.work = work;
      shown.text.textContent = work.text;
      shown.row.title = work.title ?? "";
      shown.stop.hidden = work.stop === null;
      shown.bar.hidden = work.share === null;
      shown.bar.value = work.share ?? 0;
      shown.left.note(work.text, work.share, performance.now() / 1000);
    }
    showFigures();
  }

  function showFigures() {
    for (const { work, figures, left } of rows.values()) {
      const seconds = work.share === null ? null : left.at(performance.now() / 1000);
      const text = [work.done, seconds === null ? "" : timeText(seconds)].filter(Boolean).join(", ");
      if (figures.textContent !== text) figures.textContent = text;
    }
  }

  /** @param {Work} work */
  function add(work) {
    const row = make("div", { className: "work", id: `work-${work.id}` });
    const [text, figures] = [make("b"), make("output")];
    const bar = make("progress", { "aria-label": work.text });
    const stop = make("button", { type: "button", title: "Stop; what is done and stored stays" }, "Stop");
    const shown = { row, text, figures, bar, stop, left: new TimeLeft(), work };
    stop.addEventListener("click", () => shown.work.stop?.());
    row.append(text, stop, figures, bar);
    rows.set(work.id, shown);
    list.append(row);
    return shown;
  }

  /** @returns {Work[]} */
  function listWork() {
    const { state, finding, acquisition, session, exporting } = store.facts;
    if (!state) return [];
    const { track, range, compiling, footage } = state;
    const name = session?.people[acquisition?.person ?? 0]?.name ?? "";
    const stopFinding = () => send({ type: "find_people", action: "stop" });
    const run = hasTrack(state) ? trackWork(track, finding?.running ? stopFinding : () => actions.stopTracking()) : null;
    const search = finding?.running && !run && { id: "find", text: `Find people: ${finding.stage}`, ...shareOf(finding.share), stop: stopFinding };
    const sizes = acquisition?.running && {
      id: "sizes",
      text: `Acquiring sizes of ${name}: ${acquisition.stage}`,
      ...shareOf(acquisition.share),
      stop: () => send({ type: "acquire", action: "stop", person: acquisition.person }),
    };
    const frames = range.running && {
      id: "range",
      text: capital(range.what),
      ...ofTotal(range.done, range.total),
      stop: () => actions.stopRange(),
    };
    const files = exporting !== null && { id: "export", text: "Exporting", ...shareOf(exporting), stop: cancelExport };
    const kernels = compiling !== null && {
      id: "compiling",
      text: `Compiling ${displayName(compiling)}`,
      done: "you can go on",
      title: COMPILING,
      share: null,
      stop: null,
    };
    const index = footage.listed !== null && { id: "indexing", text: "Indexing the footage", ...shareOf(footage.listed), title: INDEXING, stop: null };
    return [search, run, sizes, frames, files, kernels, index].filter((work) => !!work);
  }

  function showDamage() {
    const error = store.facts.state?.footage.error ?? null;
    damage.hidden = error === null;
    damage.title = error ?? "";
  }

  function watchFinding() {
    const { finding } = store.facts;
    if (finding?.running) closeFailure();
    else if (wasFinding && finding?.failed) showFailure(finding);
    wasFinding = finding?.running ?? false;
  }

  /** @param {import("../model/protocol.js").FindingMessage} finding */
  function showFailure(finding) {
    const { message, notes, tried } = finding;
    const [reason] = message.split(/;|\.$/);
    byId("failure-text", HTMLElement).textContent = `People were not found: ${reason.charAt(0).toLowerCase()}${reason.slice(1)}.`;
    showBadSilhouette(finding);
    byId("failure-look", HTMLButtonElement).hidden = tried === null;
    byId("failure-look", HTMLButtonElement).textContent = `Show silhouettes of frame ${tried}`;
    byId("failure-details", HTMLDetailsElement).open = false;
    byId("failure-notes", HTMLElement).replaceChildren(
      ...[message, ...notes].map((text) => make("li", {}, text)),
    );
    failure.hidden = false;
    if (tried === store.facts.target) lookAtSilhouettes();
  }

  /**
   * Show the picture of the silhouette that the failure is about. Without such a view, or a silhouette, there is none.
   *
   * @param {import("../model/protocol.js").FindingMessage} finding
   */
  function showBadSilhouette({ camera, tried }) {
    const { session } = store.facts;
    const picture = byId("failure-silhouette", HTMLImageElement);
    picture.hidden = true;
    picture.removeAttribute("src");
    if (!session || tried === null || camera === null) return;
    picture.alt = picture.title = `Silhouette in ${session.cameras[camera].name} on frame ${tried}`;
    picture.onload = () => (picture.hidden = false);
    picture.src = `silhouette/${camera}/${tried}`;
  }

  /** Show the silhouettes of the frame and the view that the failure is about. */
  function lookAtSilhouettes() {
    const { finding } = store.facts;
    if (!finding || finding.tried === null) return;
    navigation.goTo(finding.tried);
    hasSilhouettes ||= !store.facts.layers.shown.silhouette;
    layers.toggle(["silhouette"], true);
    if (finding.camera !== null) store.set({ active: finding.camera });
  }

  function closeFailure() {
    failure.hidden = true;
    if (hasSilhouettes) layers.toggle(["silhouette"], false);
    hasSilhouettes = false;
  }

  function placeByHand() {
    const { finding, state } = store.facts;
    const person = state?.people.findIndex(({ source }) => source === null) ?? 0;
    if (finding && finding.tried !== null) navigation.goTo(finding.tried);
    send({ type: "select", person: Math.max(0, person), point: "torso" });
    closeFailure();
    notify({ type: "notice", level: "info", text: "Drag the square of the body in two views, then joints; G fits the body to the edges." });
  }
}

/**
 * @param {import("../model/protocol.js").Track} track
 * @param {() => void} stop
 * @returns {Work}
 */
function trackWork({ running, stage, done, total }, stop) {
  // No frame waits for what comes after the first pass.
  const text = { tracking: "Tracking", back: "Tracking backward", solve: "Estimating all frames together" }[stage];
  const figures = ofTotal(done, total);
  const isFirst = stage === "tracking";
  return { id: "track", text: running ? text : "Tracking is paused", ...figures, done: isFirst ? figures.done : "you can go on", stop };
}

/** @param {number} share 0 to 1 */
function shareOf(share) {
  return { share, done: percent(share) };
}

/**
 * @param {number} done
 * @param {number} total
 */
function ofTotal(done, total) {
  return { share: done / Math.max(1, total), done: `${count(done)} of ${count(total)}` };
}
