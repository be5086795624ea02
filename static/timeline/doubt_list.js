/** Tab of the drawer that lists doubtful and lost poses and doubted keyframes with thumbnails, the most severe first. */

import { byId, iconButton, make, textButton } from "../widgets/elements.js";
import { count, displayName, percent } from "../widgets/text.js";
import { reasonOf } from "../model/selectors.js";
import { contradictions } from "../model/keyframe_doubts.js";
import { countDoubts } from "./doubts.js";
import { makeThumbnailLoader } from "./thumbnail_loader.js";

/** Entries that are listed at first, and after "more". The others follow as these are resolved. */
const FEW_LISTED = 10;
const MAX_LISTED = 200;
/** Facts that the list is made of. @type {(keyof import("../model/store.js").Facts)[]} */
const LISTED = ["timeline", "lanes", "session", "keyframeDoubts", "layers"];
const TICK = "m3 8.5 3.5 3.5L13 4.5";

/** @typedef {import("./doubts.js").Doubt} Doubt */

/**
 * @param {import("../model/store.js").Store} store
 * @param {import("./doubt_queue.js").DoubtQueue} queue
 */
export function mountDoubtList(store, queue) {
  const panel = byId("doubts", HTMLElement);
  const list = byId("doubt-list", HTMLOListElement);
  const empty = byId("doubts-empty", HTMLElement);
  const tabCount = byId("doubts-count", HTMLElement);
  const loader = makeThumbnailLoader(panel);
  /** @type {Map<string, HTMLLIElement>} rows by what they show */
  let rowsByKey = new Map();
  let limit = FEW_LISTED;
  const moreButton = make("button", { type: "button", className: "doubt-more", title: "List less severe entries too" });
  const moreRow = make("li", {}, moreButton);
  moreButton.addEventListener("click", () => {
    limit = MAX_LISTED;
    show();
    list.children[FEW_LISTED]?.querySelector("button")?.focus();
  });
  store.on(["drawer"], () => store.facts.drawer !== "doubts" && (limit = FEW_LISTED));
  store.onTab("doubts", LISTED, show);
  store.onTab("doubts", [...LISTED, "target", "state", "reason"], mark);

  function show() {
    const doubts = queue.doubts();
    const shown = doubts.slice(0, limit);
    const known = rowsByKey;
    rowsByKey = new Map(shown.map((doubt) => [keyOf(doubt), known.get(keyOf(doubt)) ?? makeRow(doubt)]));
    for (const [key, row] of known) {
      const image = row.querySelector("img");
      if (!rowsByKey.has(key) && image) loader.forget(image);
    }
    const hidden = doubts.length - shown.length;
    moreButton.textContent = `${count(hidden)} more`;
    const rows = [...rowsByKey.values(), ...(hidden > 0 && limit < MAX_LISTED ? [moreRow] : [])];
    if (rows.length !== list.children.length || rows.some((row, i) => row !== list.children[i])) {
      const focused = list.contains(document.activeElement) ? document.activeElement : null;
      const at = focused ? [...list.children].findIndex((row) => row.contains(focused)) : -1;
      list.replaceChildren(...rows);
      // If the focused entry was resolved, the next one takes its place.
      if (at >= 0) (focused?.isConnected ? /** @type {HTMLElement} */ (focused) : rows[Math.min(at, rows.length - 1)]?.querySelector("button"))?.focus();
    }
    const listed = hidden > 0 ? `, the ${count(shown.length)} most severe are listed` : ", most severe first";
    tabCount.textContent = doubts.length === 0 ? "" : `${count(doubts.length)} to check${listed}`;
    empty.hidden = doubts.length > 0;
    if (doubts.length === 0) empty.textContent = emptyText();
  }

  function emptyText() {
    const { timeline } = store.facts;
    const { all, resolved } = countDoubts(store.facts);
    if (all > 0) return `All ${count(resolved)} doubtful and lost poses are confirmed or reviewed.`;
    if (timeline.statuses.some((status) => status > 0)) return "No pose is doubtful or lost.";
    return "No frame has been tracked. Once frames are tracked, doubtful and lost poses are listed here.";
  }

  /** Mark the entry of the current frame. */
  function mark() {
    const current = queue.current();
    const key = current ? keyOf(current) : null;
    for (const [own, row] of rowsByKey) {
      const isCurrent = own === key;
      if (isCurrent) explain(row, current?.worst === store.facts.reason?.frame ? reasonOf(store.facts) : "");
      if (row.classList.contains("is-current") === isCurrent) continue;
      row.classList.toggle("is-current", isCurrent);
      row.querySelector("button")?.setAttribute("aria-current", String(isCurrent));
      if (isCurrent) row.scrollIntoView({ block: "nearest" });
    }
  }

  /** @param {Doubt} doubt */
  function keyOf({ person, spans, worst, status, limbs, keyframe }) {
    const cost = cellsOf(person)?.costs[worst];
    return JSON.stringify([person, spans, worst, status, cost, limbs, keyframe, store.facts.layers.shown.faces]);
  }

  /** @param {number} person */
  function cellsOf(person) {
    const { lanes, timeline } = store.facts;
    return lanes.length > 0 ? lanes[person] : timeline;
  }

  /**
   * @param {Doubt} doubt
   * @returns {HTMLLIElement}
   */
  function makeRow(doubt) {
    const { session, calibration, layers } = store.facts;
    const { person, first, last, spans, worst, status, limbs, limb, keyframe } = doubt;
    const info = session?.people[person];
    const image = make("img", { alt: "", draggable: false });
    const cost = cellsOf(person)?.costs[worst] ?? 0;
    const query = `${limb === null ? "" : `limb=${limb}&`}${layers.shown.faces ? "blurred&" : ""}`;
    loader.watch(image, `thumbnail/${person}/${worst}?${query}v=${cost}-${calibration?.revision ?? 1}`);
    const frames = `${first === last ? `frame ${first}` : `frames ${first}–${last}`}${spans.length > 1 ? `, in ${spans.length} stretches` : ""}`;
    const remark = cellsOf(person)?.get(worst)?.remark ?? "";
    const why =
      keyframe && session ? contradictions(keyframe, session).map((one) => `disagrees ${one}`)
      : limbs.length ? limbs.slice(0, 2).map(chanceOf)
      : [displayName(remark) || "pose uncertain"];
    const text = make(
      "span",
      "doubt-text",
      line(`status-badge is-${keyframe ? "doubtful" : status}`, keyframe ? "keyframe" : status),
      ...((session?.people.length ?? 1) > 1 && info ? [named(info)] : []),
      ...why.map((words) => line("doubt-limb", words)),
      line("quiet", frames),
    );
    const title = `Go to frame ${worst}, the worst of ${frames}: ${why.join("; ")}`;
    const go = textButton("", title, () => queue.visit(doubt), { className: "doubt", "data-no-command": "" });
    go.append(image, text);
    const accepts = keyframe ? "this keyframe is right" : `mark ${frames} as reviewed`;
    const accept = iconButton(TICK, `Accept: ${accepts}`, () => queue.accept(doubt));
    accept.classList.add("doubt-accept");
    return make("li", {}, go, accept);
  }
}

/**
 * The chance of a limb; only the likeliest one needs the whole phrase.
 *
 * @param {import("./cell_text.js").DoubtfulLimb} limb
 * @param {number} rank
 */
function chanceOf({ name, lost }, rank) {
  return rank > 0 ? `${name}: ${percent(lost)}` : `${name}: ${percent(lost)} chance that it is lost`;
}

/**
 * @param {string} kind classes
 * @param {string} text
 */
function line(kind, text) {
  return make("span", `${kind} is-clipped`, text);
}

/**
 * Show the part and the view that contradict the pose of an entry.
 *
 * @param {HTMLElement} row
 * @param {string} sentence empty while unknown
 */
function explain(row, sentence) {
  if (!sentence) return;
  const known = row.querySelector(".doubt-reason") ?? line("doubt-reason", "");
  known.textContent = sentence;
  row.querySelector(".doubt-text > .quiet")?.before(known);
}

/** @param {import("../model/protocol.js").PersonInfo} person */
function named({ name, color }) {
  return make("span", { className: "person-name is-clipped", "--person": color }, name);
}
