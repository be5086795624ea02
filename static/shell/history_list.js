/** Popover that lists the history. A click on an entry undoes or redoes up to it. */

import { byId, make } from "../widgets/elements.js";
import { opensPopover, togglePopover } from "../widgets/popovers.js";

const FIRST_LIMIT = 100;
const MOST = 2000;

export class HistoryList {
  #store;
  #send;
  #panel = byId("history-panel", HTMLElement);
  #button = byId("show-history", HTMLButtonElement);
  #list = byId("history-list", HTMLElement);
  #limit = 0;

  /**
   * @param {import("../model/store.js").Store} store
   * @param {(message: import("../model/protocol.js").ClientMessage) => void} send
   */
  constructor(store, send) {
    this.#store = store;
    this.#send = send;
    opensPopover(this.#panel, this.#button, () => this.toggle());
    this.#panel.addEventListener("toggle", () => {
      const isOpen = this.#panel.matches(":popover-open");
      if (isOpen) this.#list.querySelector("[aria-current]")?.scrollIntoView({ block: "center" });
      else this.#ask(0);
    });
    this.#list.addEventListener("keydown", (event) => this.#onKey(event));
    store.on(["history"], () => this.#show());
    store.on(["connected"], () => store.facts.connected && this.#limit > 0 && this.#ask(this.#limit));
  }

  toggle() {
    togglePopover(this.#panel, this.#button);
    if (!this.#panel.matches(":popover-open")) return;
    this.#ask(FIRST_LIMIT);
    this.#panel.focus();
  }

  /** @param {number} limit entries in each direction; 0 to end updates */
  #ask(limit) {
    this.#limit = limit;
    this.#send({ type: "history", limit });
  }

  #show() {
    const { history } = this.#store.facts;
    if (!history) return;
    const had = document.activeElement instanceof HTMLElement ? document.activeElement.dataset.edit : undefined;
    const wasEmpty = this.#list.childElementCount === 0;
    const { entries, earlier, later } = history;
    const current = entries.find(({ undone }) => !undone)?.edit ?? null;
    const rows = entries.map((entry) => this.#row(entry, entry.edit === current));
    if (later) rows.unshift(this.#more("Show later entries"));
    if (earlier) rows.push(this.#more("Show earlier entries"));
    else rows.push(this.#beginning(current === null));
    this.#list.replaceChildren(...rows);
    const again = had === undefined ? null : this.#list.querySelector(`[data-edit="${had}"]`);
    if (again instanceof HTMLElement) again.focus();
    else if (wasEmpty || this.#panel.matches(":focus-within")) {
      /** @type {HTMLElement | null} */ (this.#list.querySelector("[aria-current]"))?.focus();
    }
  }

  /**
   * @param {import("../model/protocol.js").HistoryEntry} entry
   * @param {boolean} isCurrent
   */
  #row({ edit, label, author, time, undone }, isCurrent) {
    const when = new Date(time);
    const [what, frame] = split(label);
    const where = [what, frame, author, displayTime(when)];
    const title = `${label}${author ? `, by ${author}` : ""}, ${when.toLocaleString()}${undone ? "; undone" : ""}. ${
      isCurrent ? "Current state." : undone ? "Redo up to here." : "Undo back to here."
    }`;
    return this.#entry(edit, where, title, isCurrent, undone);
  }

  /** @param {boolean} isCurrent */
  #beginning(isCurrent) {
    const title = isCurrent ? "Current state." : "Undo everything, back to the start of the session.";
    return this.#entry(null, ["Beginning", "", "", ""], title, isCurrent, false);
  }

  /**
   * @param {number | null} edit
   * @param {string[]} cells
   * @param {string} title
   * @param {boolean} isCurrent
   * @param {boolean} isUndone
   */
  #entry(edit, cells, title, isCurrent, isUndone) {
    const row = make("button", { type: "button", title, "data-edit": String(edit) }, ...cells.map((text) => make("span", "is-clipped", text)));
    row.classList.toggle("is-undone", isUndone);
    if (isCurrent) row.setAttribute("aria-current", "step");
    row.addEventListener("click", () => isCurrent || this.#send({ type: "go_to", edit }));
    return make("li", {}, row);
  }

  /** @param {string} text */
  #more(text) {
    const isLast = this.#limit >= MOST;
    const title = isLast ? `Only ${MOST.toLocaleString("en")} entries are listed. Undo and redo also reach the others` : text;
    const ask = () => this.#ask(Math.min(MOST, 4 * this.#limit));
    return make("li", {}, make("button", { type: "button", className: "is-more", title, disabled: isLast, onclick: ask }, title));
  }

  /** @param {KeyboardEvent} event */
  #onKey(event) {
    const rows = [...this.#list.querySelectorAll("button")];
    const at = rows.findIndex((row) => row === document.activeElement);
    const to = { ArrowDown: at + 1, ArrowUp: at - 1, Home: 0, End: rows.length - 1 }[event.key];
    if (to === undefined) return;
    event.preventDefault();
    rows[Math.max(0, Math.min(rows.length - 1, to))]?.focus();
  }
}

/**
 * Split `drag left wrist, frame 3` into action and frame.
 *
 * @param {string} label
 */
function split(label) {
  const found = /^(.*) (frames? [\d ,to–-]+)$/.exec(label);
  return found ? [found[1].replace(/,$/, ""), found[2]] : [label, ""];
}

/** @param {Date} when */
function displayTime(when) {
  const minutes = (Date.now() - when.getTime()) / 60_000;
  if (minutes < 1) return "just now";
  if (minutes < 60) return `${Math.floor(minutes)} min ago`;
  const time = when.toLocaleTimeString([], { hour: "2-digit", minute: "2-digit" });
  const isToday = when.toDateString() === new Date().toDateString();
  return isToday ? time : `${when.toLocaleDateString([], { day: "numeric", month: "short" })}, ${time}`;
}
