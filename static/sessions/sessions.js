/** Popover that opens another session: a recent one, or a folder by its path, which is completed as the user types. */

import { byId, make } from "../widgets/elements.js";
import { opensPopover, togglePopover } from "../widgets/popovers.js";
import { postJson } from "../widgets/post_json.js";
import { batchTable } from "./batch_table.js";
import { BoardCalibration } from "./board_calibration.js";
import { NewSession } from "./new_session.js";
import { makePathField } from "./path_field.js";
import { PathPicker } from "./path_picker.js";
import { completePaths } from "./session_requests.js";

const POLL_MS = 300;
/** A slow disk and an old processor need half of it. */
const PATIENCE_MS = 60_000;

/**
 * @typedef {{folder: string, name: string, opened: string}} Recent
 * @typedef {import("./batch_table.js").Batch} Batch
 * @typedef {{refusal: string | null, folder: string, recent: Recent[], batches: Batch[]}} Listed
 */

export class Sessions {
  #panel = byId("sessions-panel", HTMLElement);
  #open = byId("session-name", HTMLButtonElement);
  #folder = byId("session-folder", HTMLInputElement);
  #list = byId("recent-sessions", HTMLElement);
  #note = byId("sessions-note", HTMLOutputElement);
  #form = byId("open-session", HTMLFormElement);

  #store;
  #picker = new PathPicker();
  #create;
  #board;
  /** Folder of the open session. */
  #present = "";

  #notify;

  /**
   * @param {import("../model/store.js").Store} store
   * @param {(notice: import("../model/protocol.js").NoticeMessage) => void} notify
   */
  constructor(store, notify) {
    this.#store = store;
    this.#notify = notify;
    opensPopover(this.#panel, this.#open, () => this.toggle());
    this.#form.addEventListener("submit", (event) => {
      event.preventDefault();
      void this.#choose(this.#folder.value);
    });
    this.#create = new NewSession(this.#picker, (folder) => {
      this.toggle();
      void this.#choose(folder);
    });
    this.#board = new BoardCalibration(this.#picker, (out, up) => this.#create.showWith(out, up));
    byId("show-new-session", HTMLButtonElement).addEventListener("click", () => void this.showNew());
    byId("show-board-calibration", HTMLButtonElement).addEventListener("click", () => void this.showBoard());
    completePaths(this.#folder, byId("session-folders", HTMLDataListElement));
    /** @type {string | undefined} */
    let first;
    store.on(["session"], () => {
      first ??= store.facts.session?.name;
      // Another page has opened another session: everything here belongs to the former one.
      if (first !== store.facts.session?.name) location.reload();
    });
  }

  /**
   * Complete a field of another form that takes files or folders, and give it the path picker.
   *
   * @param {HTMLInputElement} input
   */
  completes = (input) => makePathField(input, this.#picker);

  toggle() {
    togglePopover(this.#panel, this.#open);
    if (!this.#panel.matches(":popover-open")) return;
    this.#say("");
    this.#folder.focus();
    void this.#fill();
  }

  /** Show the form of a new session, or why there is none. */
  showNew() {
    return this.#showForm(this.#create, "session");
  }

  /** Show the form of a calibration by a board, or why there is none. */
  showBoard() {
    return this.#showForm(this.#board, "calibration");
  }

  /**
   * @param {{show: () => void}} form
   * @param {string} result
   */
  async #showForm(form, result) {
    const { refusal, folder } = await listed();
    if (refusal) {
      this.#notify({ type: "notice", level: "error", text: `No ${result} can be made here: ${refusal}` });
      return;
    }
    this.#present = folder;
    if (this.#panel.matches(":popover-open")) this.#panel.hidePopover();
    form.show();
  }

  async #fill() {
    const found = await listed();
    this.#present = found.folder;
    for (const control of [...this.#form.elements, byId("show-new-session", HTMLButtonElement)]) {
      /** @type {HTMLInputElement} */ (control).disabled = found.refusal !== null;
    }
    if (found.refusal) this.#say(found.refusal, true);
    this.#list.replaceChildren(...found.recent.map((one) => this.#row(one)));
    byId("batches", HTMLElement).replaceChildren(
      ...found.batches.map((batch) => batchTable(batch, (folder, at) => void this.#choose(folder, at))),
    );
    if (!found.recent.length && !found.refusal) this.#list.append(this.#firstRow());
    if (document.activeElement === document.body) this.#folder.focus();
  }

  /** Say what to do where no other session was opened before. */
  #firstRow() {
    const text = "No other session was opened before. Make one of your own videos and their calibration:";
    const title = "Make a session of videos and a calibration";
    const create = make("button", { type: "button", className: "is-primary", title, onclick: () => void this.showNew() }, "New session…");
    return make("li", "is-empty", text, create);
  }

  /** @param {Recent} session */
  #row({ folder, name, opened }) {
    const title = `Close this session and open ${folder}`;
    const open = make("button", { type: "button", title, onclick: () => void this.#choose(folder) });
    const when = make("time", { dateTime: opened }, new Date(opened).toLocaleDateString([], { day: "numeric", month: "short" }));
    open.append(make("b", {}, name), when, make("small", "is-clipped", make("bdi", {}, folder)));
    return make("li", {}, open);
  }

  /**
   * @param {string} folder
   * @param {{frame?: number, person?: string}} at what it shows first
   */
  async #choose(folder, at = {}) {
    this.#say("Checking…");
    try {
      await postJson("sessions/open", { folder, ...at }, (answer) => this.#store.set({ opening: JSON.parse(answer).name }));
      this.#panel.hidePopover();
    } catch (error) {
      this.#say(error instanceof Error ? error.message : String(error), true);
      return;
    }
    const showStep = (/** @type {string} */ step) => this.#store.set({ openingStep: step });
    if (await untilAnotherIsOpen(this.#present, showStep)) {
      location.reload();
      return;
    }
    const text = `Expected ${this.#store.facts.opening} to be open by now. The terminal of the program says what is wrong.`;
    this.#store.set({ opening: null, openingStep: "" });
    this.#notify({ type: "notice", level: "error", text });
  }

  /**
   * @param {string} text
   * @param {boolean} isFailure
   */
  #say(text, isFailure = false) {
    this.#note.textContent = text;
    this.#note.classList.toggle("is-failed", isFailure);
  }
}

/**
 * Wait until the program has been replaced by one that serves another session. Returns whether it has in time.
 *
 * @param {string} present folder of the session that is being closed
 * @param {(step: string) => void} showStep called with what the program is doing
 */
async function untilAnotherIsOpen(present, showStep) {
  const deadline = performance.now() + PATIENCE_MS;
  while (performance.now() < deadline) {
    await new Promise((resolve) => setTimeout(resolve, POLL_MS));
    try {
      const { steps, at, folder } = await (await fetch("starting.json", { cache: "no-store" })).json();
      if (steps.length) showStep(steps[at]);
      else if (folder !== present) return true;
    } catch {
      // The program is starting.
    }
  }
  return false;
}

/** The sessions that the program lists. @returns {Promise<Listed>} */
async function listed() {
  try {
    return await (await fetch("sessions")).json();
  } catch {
    return { refusal: "The program does not answer.", folder: "", recent: [], batches: [] };
  }
}
