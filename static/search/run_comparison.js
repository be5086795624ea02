/** Tab of the drawer that compares the poses of a range with those that they replaced, such as those of another tracker. */

import { button, byId, make } from "../widgets/elements.js";
import { capital, count, displayName } from "../widgets/text.js";

/**
 * @typedef {import("../model/protocol.js").ComparedPose} ComparedPose
 * @typedef {import("../model/protocol.js").Stretch} Stretch
 */

/** Smallest difference of costs that counts, px: as much as is displayed. */
const LEAST_PX = 0.005;

export class RunComparison {
  #store;
  #navigation;
  #actions;
  #open;
  #panel = byId("run-comparison", HTMLElement);
  #controls = byId("run-comparison-controls", HTMLElement);
  #text = byId("run-comparison-text", HTMLElement);
  #empty = byId("run-comparison-empty", HTMLElement);
  #table = byId("run-comparison-table", HTMLTableElement);
  #rows = byId("run-comparison-rows", HTMLElement);
  #heads = [byId("run-comparison-now", HTMLElement), byId("run-comparison-other", HTMLElement)];
  #take;
  #end;
  #stretches = byId("run-stretches", HTMLElement);
  /** Stretches of the last run that the user has kept, by person and first frame. @type {Set<string>} */
  #kept = new Set();
  /** @type {number | null | undefined} the last run; undefined before the first message */
  #run;
  #wasRunning = false;
  /** @type {import("../model/series.js").Tab | null | undefined} the open tab at the end of a run whose comparison may follow */
  #tabAtEnd;

  /**
   * @param {import("../model/store.js").Store} store
   * @param {import("../model/navigation.js").Navigation} navigation
   * @param {import("../model/actions.js").Actions} actions
   * @param {() => void} open opens the tab
   */
  constructor(store, navigation, actions, open) {
    this.#store = store;
    this.#actions = actions;
    this.#open = open;
    this.#navigation = navigation;
    this.#take = button("run-comparison-take", () => actions.takeReplaced());
    this.#end = button("run-comparison-end", () => actions.compareRange(false));
    store.subscribe((changed) => {
      if (changed.has("state")) this.#followWork();
      if (changed.has("rangeComparison")) this.#followRun();
      else if (changed.has("drawer") && store.facts.drawer === null && this.#run) actions.compareRange(false);
      const isOpen = store.facts.drawer === "runs";
      this.#panel.hidden = this.#controls.hidden = !isOpen;
      if (!isOpen) return;
      if (["drawer", "rangeComparison", "state", "connected"].some((fact) => changed.has(/** @type {"drawer"} */ (fact)))) this.#show();
      if (changed.has("drawer") || changed.has("rangeComparison") || changed.has("target")) this.#mark();
    });
  }

  /** Note the open tab when a run ends: its comparison follows, but a tab that is opened meanwhile stays. */
  #followWork() {
    const isRunning = this.#isRunning;
    if (this.#wasRunning && !isRunning) this.#tabAtEnd = this.#store.facts.drawer;
    this.#wasRunning = isRunning;
  }

  get #isRunning() {
    const { state } = this.#store.facts;
    return !!state?.range?.running || !!state?.track.running;
  }

  /** Open the tab when a run has replaced poses by better or worse ones. Closing the drawer ends it. */
  #followRun() {
    const run = this.#store.facts.rangeComparison?.run ?? null;
    const isFirst = this.#run === undefined; // the page was opened after the run
    if (run === this.#run) return;
    this.#run = run;
    if (isFirst || run === null) return;
    this.#kept.clear();
    const isOther = this.#tabAtEnd !== undefined && this.#tabAtEnd !== this.#store.facts.drawer;
    this.#tabAtEnd = undefined;
    if (!isOther) this.#open();
  }

  #show() {
    const { rangeComparison, state, session, connected } = this.#store.facts;
    const person = state?.person ?? 0;
    const poses = rangeComparison?.people[person] ?? [];
    const name = (session?.people.length ?? 1) > 1 ? ` of ${session?.people[person].name}` : "";
    const isBusy = !connected || this.#isRunning;
    this.#take.disabled = isBusy || poses.length === 0;
    this.#end.disabled = !connected || !rangeComparison;
    this.#empty.hidden = poses.length > 0;
    this.#table.hidden = poses.length === 0;
    this.#empty.textContent = rangeComparison
      ? `No pose${name} in this range replaced another.`
      : "Track a range by one method, then by the other. Mark the range in the timeline and press Compare.";
    const stretches = (rangeComparison?.stretches ?? []).filter((one) => one.person === person);
    const isRun = (rangeComparison?.run ?? null) !== null;
    this.#text.textContent = poses.length > 0 ? (isRun ? gain(stretches, poses.length, name) : summary(poses, name)) : "";
    const open = stretches.filter((one) => !this.#kept.has(keyOf(one)));
    this.#stretches.hidden = !isRun || open.length === 0;
    this.#stretches.replaceChildren(...open.map((one) => this.#stretch(one, isBusy)));
    this.#heads[0].textContent = `Present: ${methods(poses.map(({ method }) => method))}, cost in px and status`;
    this.#heads[1].textContent = `Replaced: ${methods(poses.map(({ other_method }) => other_method))}, cost in px and status`;
    const largest = Math.max(1, ...poses.map(({ apart_mm }) => apart_mm));
    this.#rows.replaceChildren(...poses.map((pose) => this.#row(pose, largest)));
    this.#mark();
  }

  /**
   * @param {Stretch} stretch
   * @param {boolean} isBusy
   */
  #stretch(stretch, isBusy) {
    const { first, last, person, verdict, frames } = stretch;
    const item = make("li", `is-${verdict}`);
    const named = first === last ? `frame ${first}` : `frames ${first}–${last}`;
    const go = small(capital(named), `Go to frame ${first}`, () => this.#navigation.goTo(first));
    const text = make("span", {}, `${verdict} on ${count(frames)}`);
    const keep = small("Keep", `Keep the new poses of ${named}`, () => {
      this.#kept.add(keyOf(stretch));
      this.#show();
    });
    const back = small("Take back", `Put the replaced poses of ${named} back; keyframes stay. Again takes the new ones`, () =>
      this.#actions.takeReplaced({ person, first, last }),
    );
    back.disabled = isBusy;
    item.append(go, text, keep, back);
    return item;
  }

  /**
   * @param {ComparedPose} pose
   * @param {number} largest mean distance of all rows, mm
   */
  #row(pose, largest) {
    const row = make("tr", { "data-frame": String(pose.frame), onclick: () => this.#navigation.goTo(pose.frame) });
    const head = make("th", { scope: "row" }, make("button", { type: "button", title: `Go to frame ${pose.frame}` }, String(pose.frame)));
    const [now, other] = [pose.cost_px, pose.other_cost_px];
    const apart = cell(pose.apart_mm.toFixed(1));
    apart.className = "run-comparison-apart";
    apart.style.setProperty("--share", String(pose.apart_mm / largest));
    row.append(
      head,
      cost(now, other),
      status(pose.status),
      cost(other, now),
      status(pose.other_status),
      apart,
      cell(`${pose.farthest_mm.toFixed(1)}, ${pose.farthest}`),
    );
    return row;
  }

  #mark() {
    const { target } = this.#store.facts;
    for (const row of this.#rows.children) {
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

/** @param {string} text */
function cell(text) {
  return make("td", {}, text);
}

/**
 * @param {number | null} own
 * @param {number | null} other
 */
function cost(own, other) {
  const element = cell(own === null ? "–" : own.toFixed(2));
  element.classList.toggle("is-better", own !== null && other !== null && own < other - LEAST_PX);
  return element;
}

/** @param {string} text */
function status(text) {
  const element = cell(text || "–");
  element.dataset.status = text;
  return element;
}
