/** Popover that lists the history. A click on an entry undoes or redoes up to it. */

import { byId, make } from "../widgets/elements.js";
import { opensPopover, togglePopover } from "../widgets/popovers.js";

const FIRST_LIMIT = 100;
const MOST = 2000;

/** @typedef {ReturnType<typeof mountHistoryList>} HistoryList */

/**
 * @param {import("../model/store.js").Store} store
 * @param {(message: import("../model/protocol.js").ClientMessage) => void} send
 */
export function mountHistoryList(store, send) {
  const panel = byId("history-panel", HTMLElement);
  const button = byId("show-history", HTMLButtonElement);
  const list = byId("history-list", HTMLElement);
  let nEntries = 0;
  opensPopover(panel, button, () => toggle());
  panel.addEventListener("toggle", () => {
    const isOpen = panel.matches(":popover-open");
    if (isOpen) list.querySelector("[aria-current]")?.scrollIntoView({ block: "center" });
    else request(0);
  });
  list.addEventListener("keydown", (event) => onKey(event));
  store.on(["history"], () => show());
  store.on(["connected"], () => store.facts.connected && nEntries > 0 && request(nEntries));

  function toggle() {
    togglePopover(panel, button);
    if (!panel.matches(":popover-open")) return;
    request(FIRST_LIMIT);
    panel.focus();
  }

  /** @param {number} limit entries in each direction; 0 to end updates */
  function request(limit) {
    nEntries = limit;
    send({ type: "history", limit });
  }

  function show() {
    const { history } = store.facts;
    if (!history) return;
    const had = document.activeElement instanceof HTMLElement ? document.activeElement.dataset.edit : undefined;
    const wasEmpty = list.childElementCount === 0;
    const { entries, earlier, later } = history;
    const current = entries.find(({ undone }) => !undone)?.edit ?? null;
    const rows = entries.map((entry) => row(entry, entry.edit === current));
    if (later) rows.unshift(more("Show later entries"));
    if (earlier) rows.push(more("Show earlier entries"));
    else rows.push(beginning(current === null));
    list.replaceChildren(...rows);
    const again = had === undefined ? null : list.querySelector(`[data-edit="${had}"]`);
    if (again instanceof HTMLElement) again.focus();
    else if (wasEmpty || panel.matches(":focus-within")) {
      /** @type {HTMLElement | null} */ (list.querySelector("[aria-current]"))?.focus();
    }
  }

  /**
   * @param {import("../model/protocol.js").HistoryEntry} entry
   * @param {boolean} isCurrent
   */
  function row({ edit, label, author, time, undone }, isCurrent) {
    const when = new Date(time);
    const [what, frame] = split(label);
    const where = [what, frame, author, displayTime(when)];
    const title = `${label}${author ? `, by ${author}` : ""}, ${when.toLocaleString()}${undone ? "; undone" : ""}. ${
      isCurrent ? "Current state." : undone ? "Redo up to here." : "Undo back to here."
    }`;
    return entry(edit, where, title, isCurrent, undone);
  }

  /** @param {boolean} isCurrent */
  function beginning(isCurrent) {
    const title = isCurrent ? "Current state." : "Undo everything, back to the start of the session.";
    return entry(null, ["Beginning", "", "", ""], title, isCurrent, false);
  }

  /**
   * @param {number | null} edit
   * @param {string[]} cells
   * @param {string} title
   * @param {boolean} isCurrent
   * @param {boolean} isUndone
   */
  function entry(edit, cells, title, isCurrent, isUndone) {
    const row = make("button", { type: "button", title, "data-edit": String(edit) }, ...cells.map((text) => make("span", "is-clipped", text)));
    row.classList.toggle("is-undone", isUndone);
    if (isCurrent) row.setAttribute("aria-current", "step");
    row.addEventListener("click", () => isCurrent || send({ type: "go_to", edit }));
    return make("li", {}, row);
  }

  /** @param {string} text */
  function more(text) {
    const isLast = nEntries >= MOST;
    const title = isLast ? `Only ${MOST.toLocaleString("en")} entries are listed. Undo and redo also reach the others` : text;
    const ask = () => request(Math.min(MOST, 4 * nEntries));
    return make("li", {}, make("button", { type: "button", className: "is-more", title, disabled: isLast, onclick: ask }, title));
  }

  /** @param {KeyboardEvent} event */
  function onKey(event) {
    const rows = [...list.querySelectorAll("button")];
    const at = rows.findIndex((row) => row === document.activeElement);
    const to = { ArrowDown: at + 1, ArrowUp: at - 1, Home: 0, End: rows.length - 1 }[event.key];
    if (to === undefined) return;
    event.preventDefault();
    rows[Math.max(0, Math.min(rows.length - 1, to))]?.focus();
  }

  return { toggle };
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
