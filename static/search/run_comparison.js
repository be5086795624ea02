/** Tab of the drawer that compares the poses of a range with those that they replaced, such as those of another tracker. */

import { button, byId, make } from "../widgets/elements.js";
import { capital, count, displayName } from "../widgets/text.js";

/**
 * @typedef {import("../model/protocol.js").ComparedPose} ComparedPose
 * @typedef {import("../model/protocol.js").Stretch} Stretch
 */

/** Smallest difference of costs that counts, px: as much as is displayed. */
const LEAST_PX = 0.005;

/**
 * @param {import("../model/store.js").Store} store
 * @param {import("../model/navigation.js").Navigation} navigation
 * @param {import("../model/actions.js").Actions} actions
 * @param {() => void} open opens the tab
 */
export function mountRunComparison(store, navigation, actions, open) {
  const text = byId("run-comparison-text", HTMLElement);
  const empty = byId("run-comparison-empty", HTMLElement);
  const table = byId("run-comparison-table", HTMLTableElement);
  const rows = byId("run-comparison-rows", HTMLElement);
  const heads = [byId("run-comparison-now", HTMLElement), byId("run-comparison-other", HTMLElement)];
  const stretchList = byId("run-stretches", HTMLElement);
  /** Stretches of the last run that the user has kept, by person and first frame. @type {Set<string>} */
  const kept = new Set();
  /** @type {number | null | undefined} the last run; undefined before the first message */
  let lastRun;
  let wasRunning = false;
  /** @type {import("../model/series.js").Tab | null | undefined} the open tab at the end of a run whose comparison may follow */
  let tabAtEnd;
  const take = button("run-comparison-take", () => actions.takeReplaced());
  const end = button("run-comparison-end", () => actions.compareRange(false));
  store.subscribe((changed) => {
    if (changed.has("state")) followWork();
    if (changed.has("rangeComparison")) followRun();
    else if (changed.has("drawer") && store.facts.drawer === null && lastRun) actions.compareRange(false);
  });
  store.onTab("runs", ["rangeComparison", "state", "connected"], show);
  store.onTab("runs", ["target"], mark);

  /** Note the open tab when a run ends: its comparison follows, but a tab that is opened meanwhile stays. */
  function followWork() {
    const isRunning = isAtWork();
    if (wasRunning && !isRunning) tabAtEnd = store.facts.drawer;
    wasRunning = isRunning;
  }

  function isAtWork() {
    const { state } = store.facts;
    return !!state?.range?.running || !!state?.track.running;
  }

  /** Open the tab when a run has replaced poses by better or worse ones. Closing the drawer ends it. */
  function followRun() {
    const run = store.facts.rangeComparison?.run ?? null;
    const isFirst = lastRun === undefined; // the page was opened after the run
    if (run === lastRun) return;
    lastRun = run;
    if (isFirst || run === null) return;
    kept.clear();
    const isOther = tabAtEnd !== undefined && tabAtEnd !== store.facts.drawer;
    tabAtEnd = undefined;
    if (!isOther) open();
  }

  function show() {
    const { rangeComparison, state, session, connected } = store.facts;
    const person = state?.person ?? 0;
    const poses = rangeComparison?.people[person] ?? [];
    const name = (session?.people.length ?? 1) > 1 ? ` of ${session?.people[person].name}` : "";
    const isBusy = !connected || isAtWork();
    take.disabled = isBusy || poses.length === 0;
    end.disabled = !connected || !rangeComparison;
    empty.hidden = poses.length > 0;
    table.hidden = poses.length === 0;
    empty.textContent = rangeComparison
      ? `No pose${name} in this range replaced another.`
      : "Track a range by one method, then by the other. Mark the range in the timeline and press Compare.";
    const stretches = (rangeComparison?.stretches ?? []).filter((one) => one.person === person);
    const isRun = (rangeComparison?.run ?? null) !== null;
    text.textContent = poses.length > 0 ? (isRun ? gain(stretches, poses.length, name) : summary(poses, name)) : "";
    const open = stretches.filter((one) => !kept.has(keyOf(one)));
    stretchList.hidden = !isRun || open.length === 0;
    stretchList.replaceChildren(...open.map((one) => stretch(one, isBusy)));
    heads[0].textContent = `Present: ${methods(poses.map(({ method }) => method))}, cost in px and status`;
    heads[1].textContent = `Replaced: ${methods(poses.map(({ other_method }) => other_method))}, cost in px and status`;
    const largest = Math.max(1, ...poses.map(({ apart_mm }) => apart_mm));
    rows.replaceChildren(...poses.map((pose) => makeRow(pose, largest)));
    mark();
  }

  /**
   * @param {Stretch} stretch
   * @param {boolean} isBusy
   */
  function stretch(stretch, isBusy) {
    const { first, last, person, verdict, frames } = stretch;
    const named = first === last ? `frame ${first}` : `frames ${first}–${last}`;
    const go = small(capital(named), `Go to frame ${first}`, () => navigation.goTo(first));
    const text = make("span", {}, `${verdict} on ${count(frames)}`);
    const keep = small("Keep", `Keep the new poses of ${named}`, () => {
      kept.add(keyOf(stretch));
      show();
    });
    const back = small("Take back", `Put the replaced poses of ${named} back; keyframes stay. Again takes the new ones`, () =>
      actions.takeReplaced({ person, first, last }),
    );
    back.disabled = isBusy;
    return make("li", `is-${verdict}`, go, text, keep, back);
  }

  /**
   * @param {ComparedPose} pose
   * @param {number} largest mean distance of all rows, mm
   */
  function makeRow(pose, largest) {
    const row = make("tr", { "data-frame": String(pose.frame), onclick: () => navigation.goTo(pose.frame) });
    const head = make("th", { scope: "row" }, make("button", { type: "button", title: `Go to frame ${pose.frame}` }, String(pose.frame)));
    const [now, other] = [pose.cost_px, pose.other_cost_px];
    const apart = make("td", { className: "run-comparison-apart", "--share": String(pose.apart_mm / largest) }, pose.apart_mm.toFixed(1));
    const farthest = make("td", {}, `${pose.farthest_mm.toFixed(1)}, ${pose.farthest}`);
    row.append(head, cost(now, other), status(pose.status), cost(other, now), status(pose.other_status), apart, farthest);
    return row;
  }

  function mark() {
    const { target } = store.facts;
    for (const row of rows.children) {
      const isCurrent = /** @type {HTMLElement} */ (row).dataset.frame === String(target);
      if (row.classList.contains("is-current") === isCurrent) continue;
      row.classList.toggle("is-current", isCurrent);
      row.setAttribute("aria-current", String(isCurrent));
      if (isCurrent) row.scrollIntoView({ block: "nearest" });
    }
  }
}

/**
 * @param {ComparedPose[]} poses
 * @param {string} name
 */
function summary(poses, name) {
  const mean = poses.reduce((sum, { apart_mm }) => sum + apart_mm, 0) / poses.length;
  const known = poses.filter(({ cost_px, other_cost_px }) => cost_px !== null && other_cost_px !== null);
  const better = known.filter(({ cost_px, other_cost_px }) => (cost_px ?? 0) < (other_cost_px ?? 0) - LEAST_PX).length;
  const lost = [poses.filter(({ status: s }) => s === "lost").length, poses.filter(({ other_status: s }) => s === "lost").length];
  const frames = `${count(poses.length)} frame${poses.length === 1 ? "" : "s"}`;
  return `${frames}${name}: ${mean.toFixed(1)} mm apart, present pose cheaper on ${count(better)}, lost ${lost[0]} against ${lost[1]}`;
}

/**
 * Gain and harm of a run, as in "Tracked again 60 frames: better on 40, worse on 3".
 *
 * @param {Stretch[]} stretches
 * @param {number} replaced number of frames that replaced a pose
 * @param {string} name
 */
function gain(stretches, replaced, name) {
  const on = (/** @type {Stretch["verdict"]} */ kind) =>
    count(stretches.filter(({ verdict }) => verdict === kind).reduce((sum, { frames }) => sum + frames, 0));
  return `Tracked again${name}, ${count(replaced)} frame${replaced === 1 ? "" : "s"}: better on ${on("better")}, worse on ${on("worse")}`;
}

/** @param {Stretch} stretch */
function keyOf({ person, first }) {
  return `${person} ${first}`;
}

/**
 * @param {string} text
 * @param {string} title
 * @param {() => void} run
 */
function small(text, title, run) {
  return make("button", { type: "button", title, onclick: run }, text);
}

/** @param {string[]} all */
function methods(all) {
  return [...new Set(all)].map(displayName).join(", ");
}

/**
 * @param {number | null} own
 * @param {number | null} other
 */
function cost(own, other) {
  const element = make("td", {}, own === null ? "–" : own.toFixed(2));
  element.classList.toggle("is-better", own !== null && other !== null && own < other - LEAST_PX);
  return element;
}

/** @param {string} text */
function status(text) {
  return make("td", { "data-status": text }, text || "–");
}
