/** Tab of the drawer that lists doubtful and lost poses and doubted keyframes with thumbnails, the most severe first. */

import { byId, iconButton, make } from "../widgets/elements.js";
import { count, displayName, percent } from "../widgets/text.js";
import { reasonOf } from "../model/selectors.js";
import { contradictions } from "../model/keyframe_doubts.js";
import { countDoubts } from "./doubts.js";
import { ThumbnailLoader } from "./thumbnail_loader.js";

/** Entries that are listed at first, and after "more". The others follow as these are resolved. */
const FEW_LISTED = 10;
const MAX_LISTED = 200;
const TICK = "m3 8.5 3.5 3.5L13 4.5";

/** @typedef {import("./doubts.js").Doubt} Doubt */

export class DoubtList {
  #store;
  #queue;
  #panel = byId("doubts", HTMLElement);
  #list = byId("doubt-list", HTMLOListElement);
  #empty = byId("doubts-empty", HTMLElement);
  #controls = byId("doubt-controls", HTMLElement);
  #tabCount = byId("doubts-count", HTMLElement);
  #loader = new ThumbnailLoader(this.#panel);
  /** @type {Map<string, HTMLLIElement>} rows by what they show */
  #rows = new Map();
  #limit = FEW_LISTED;
  #more = make("li");
  #moreButton = make("button", { type: "button", className: "doubt-more" });

  /**
   * @param {import("../model/store.js").Store} store
   * @param {import("./doubt_queue.js").DoubtQueue} queue
   */
  constructor(store, queue) {
    this.#store = store;
    this.#queue = queue;
    /** @type {(keyof import("../model/store.js").Facts)[]} */
    const listed = ["drawer", "timeline", "lanes", "session", "keyframeDoubts"];
    this.#moreButton.addEventListener("click", () => {
      this.#limit = MAX_LISTED;
      this.#show();
      this.#list.children[FEW_LISTED]?.querySelector("button")?.focus();
    });
    this.#more.append(this.#moreButton);
    store.subscribe((changed) => {
      const isOpen = store.facts.drawer === "doubts";
      this.#panel.hidden = this.#controls.hidden = !isOpen;
      if (!isOpen) {
        this.#limit = FEW_LISTED;
        return;
      }
      if (listed.some((fact) => changed.has(fact))) this.#show();
      if (listed.some((fact) => changed.has(fact)) || changed.has("target") || changed.has("state") || changed.has("reason")) this.#mark();
    });
  }

  #show() {
    const { doubts } = this.#queue;
    const shown = doubts.slice(0, this.#limit);
    const known = this.#rows;
    this.#rows = new Map(shown.map((doubt) => [this.#key(doubt), known.get(this.#key(doubt)) ?? this.#row(doubt)]));
    for (const [key, row] of known) {
      const image = row.querySelector("img");
      if (!this.#rows.has(key) && image) this.#loader.forget(image);
    }
    const hidden = doubts.length - shown.length;
    this.#moreButton.textContent = `${count(hidden)} more`;
    this.#moreButton.title = "List less severe entries too";
    const rows = [...this.#rows.values(), ...(hidden > 0 && this.#limit < MAX_LISTED ? [this.#more] : [])];
    if (rows.length !== this.#list.children.length || rows.some((row, i) => row !== this.#list.children[i])) {
      const focused = this.#list.contains(document.activeElement) ? document.activeElement : null;
      const at = focused ? [...this.#list.children].findIndex((row) => row.contains(focused)) : -1;
      this.#list.replaceChildren(...rows);
      // If the focused entry was resolved, the next one takes its place.
      if (at >= 0) (focused?.isConnected ? /** @type {HTMLElement} */ (focused) : rows[Math.min(at, rows.length - 1)]?.querySelector("button"))?.focus();
    }
    const listed = hidden > 0 ? `, the ${count(shown.length)} most severe are listed` : ", most severe first";
    this.#tabCount.textContent = doubts.length === 0 ? "" : `${count(doubts.length)} to check${listed}`;
    this.#empty.hidden = doubts.length > 0;
    if (doubts.length === 0) this.#empty.textContent = this.#emptyText();
  }

  #emptyText() {
    const { timeline } = this.#store.facts;
    const { all, resolved } = countDoubts(this.#store.facts);
    if (all > 0) return `All ${count(resolved)} doubtful and lost poses are confirmed or reviewed.`;
    if (timeline.statuses.some((status) => status > 0)) return "No pose is doubtful or lost.";
    return "No frame has been tracked. Press T to track; doubtful and lost poses are listed here.";
  }

  /** Mark the entry of the current frame. */
  #mark() {
    const current = this.#queue.current;
    const key = current ? this.#key(current) : null;
    for (const [own, row] of this.#rows) {
      const isCurrent = own === key;
      if (isCurrent) explain(row, current?.worst === this.#store.facts.reason?.frame ? reasonOf(this.#store.facts) : "");
      if (row.classList.contains("is-current") === isCurrent) continue;
      row.classList.toggle("is-current", isCurrent);
      row.querySelector("button")?.setAttribute("aria-current", String(isCurrent));
      if (isCurrent) row.scrollIntoView({ block: "nearest" });
    }
  }

  /** @param {Doubt} doubt */
  #key({ person, spans, worst, status, limbs, keyframe }) {
    const cost = this.#cellsOf(person)?.costs[worst];
    return JSON.stringify([person, spans, worst, status, cost, limbs, keyframe]);
  }

  /** @param {number} person */
  #cellsOf(person) {
    const { lanes, timeline } = this.#store.facts;
    return lanes.length > 0 ? lanes[person] : timeline;
  }

  /**
   * @param {Doubt} doubt
   * @returns {HTMLLIElement}
   */
  #row(doubt) {
    const { session, calibration } = this.#store.facts;
    const { person, first, last, spans, worst, status, limbs, limb, keyframe } = doubt;
    const info = session?.people[person];
    const row = make("li");
    const go = make("button", { type: "button", className: "doubt", "data-no-command": "" });
    const image = make("img", { alt: "", draggable: false });
    const cost = this.#cellsOf(person)?.costs[worst] ?? 0;
    this.#loader.watch(image, `thumbnail/${person}/${worst}?${limb === null ? "" : `limb=${limb}&`}v=${cost}-${calibration?.revision ?? 1}`);
    const text = make("span", "doubt-text");
    const frames = `${first === last ? `frame ${first}` : `frames ${first}–${last}`}${spans.length > 1 ? `, in ${spans.length} stretches` : ""}`;
    const remark = this.#cellsOf(person)?.get(worst)?.remark ?? "";
    const why =
      keyframe && session ? contradictions(keyframe, session).map((one) => `disagrees ${one}`)
      : limbs.length ? limbs.slice(0, 2).map(chanceOf)
      : [displayName(remark) || "pose uncertain"];
    text.append(
      line("status-badge", keyframe ? "keyframe" : status, keyframe ? "is-doubtful" : `is-${status}`),
      ...((session?.people.length ?? 1) > 1 && info ? [named(info)] : []),
      ...why.map((words) => line("doubt-limb", words)),
      line("quiet", frames),
    );
    go.append(image, text);
    go.title = `Go to frame ${worst}, the worst of ${frames}: ${why.join("; ")}`;
    go.addEventListener("click", (event) => {
      if (event.detail > 0) go.blur();
      this.#queue.visit(doubt);
    });
    const accepts = keyframe ? "this keyframe is right" : `mark ${frames} as reviewed`;
    const accept = iconButton(TICK, `Accept: ${accepts} (Alt+Enter)`, () => this.#queue.accept(doubt));
    accept.classList.add("doubt-accept");
    row.append(go, accept);
    return row;
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
 * @param {string} kind class
 * @param {string} text
 * @param {string} [more] another class
 */
function line(kind, text, more) {
  const one = make("span", kind);
  if (more) one.classList.add(more);
  one.textContent = text;
  return one;
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
  row.classList.add("is-explained");
  row.querySelector(".doubt-text > .quiet")?.before(known);
}

/** @param {import("../model/protocol.js").PersonInfo} person */
function named({ name, color }) {
  const one = line("person-name", name);
  one.style.setProperty("--person", color);
  return one;
}
