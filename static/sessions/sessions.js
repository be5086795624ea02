/** Popover that opens another session: a recent one, or a folder by its path, which is completed as the user types. */

import { byId, make } from "../widgets/elements.js";
import { opensPopover, togglePopover } from "../widgets/popovers.js";
import { postJson } from "../widgets/post_json.js";
import { batchTable } from "./batch_table.js";
import { BoardCalibration } from "./board_calibration.js";
import { NewSession } from "./new_session.js";
import { makePathField } from "./path_field.js";
import { makePathPicker } from "./path_picker.js";
import { completePaths } from "./session_requests.js";

const POLL_MS = 300;
/** A slow disk and an old processor need half of it. */
const PATIENCE_MS = 60_000;

/** @typedef {ReturnType<typeof mountSessions>} Sessions */

/**
 * @typedef {{folder: string, name: string, opened: string}} Recent
 * @typedef {import("./batch_table.js").Batch} Batch
 * @typedef {{refusal: string | null, folder: string, recent: Recent[], batches: Batch[]}} Listed
 * @param {import("../model/store.js").Store} store
 * @param {(text: string) => void} refuse says why something cannot be done
 */
export function mountSessions(store, refuse) {
  const panel = byId("sessions-panel", HTMLElement);
  const open = byId("session-name", HTMLButtonElement);
  const folder = byId("session-folder", HTMLInputElement);
  const list = byId("recent-sessions", HTMLElement);
  const note = byId("sessions-note", HTMLOutputElement);
  const form = byId("open-session", HTMLFormElement);
  const picker = makePathPicker();
  /** Folder of the open session. */
  let present = "";
  /**
   * Complete a field of another form that takes files or folders, and give it the path picker.
   *
   * @param {HTMLInputElement} input
   */
  const completes = (input) => makePathField(input, picker);
  opensPopover(panel, open, () => toggle());
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    void choose(folder.value);
  });
  const create = new NewSession(picker, (folder) => {
    toggle();
    void choose(folder);
  });
  const board = new BoardCalibration(picker, (out, up) => create.showWith(out, up));
  byId("show-new-session", HTMLButtonElement).addEventListener("click", () => void showNew());
  byId("show-board-calibration", HTMLButtonElement).addEventListener("click", () => void showBoard());
  completePaths(folder, byId("session-folders", HTMLDataListElement));
  /** @type {string | undefined} */
  let first;
  store.on(["session"], () => {
    first ??= store.facts.session?.name;
    // Another page has opened another session: everything here belongs to the former one.
    if (first !== store.facts.session?.name) location.reload();
  });

  function toggle() {
    togglePopover(panel, open);
    if (!panel.matches(":popover-open")) return;
    say("");
    folder.focus();
    void fill();
  }

  /** Show the form of a new session, or why there is none. */
  function showNew() {
    return showForm(create, "session");
  }

  /** Show the form of a calibration by a board, or why there is none. */
  function showBoard() {
    return showForm(board, "calibration");
  }

  /**
   * @param {{show: () => void}} form
   * @param {string} result
   */
  async function showForm(form, result) {
    const { refusal, folder } = await listed();
    if (refusal) return refuse(`No ${result} can be made here: ${refusal}`);
    present = folder;
    if (panel.matches(":popover-open")) panel.hidePopover();
    form.show();
  }

  async function fill() {
    const found = await listed();
    present = found.folder;
    for (const control of [...form.elements, byId("show-new-session", HTMLButtonElement)]) {
      /** @type {HTMLInputElement} */ (control).disabled = found.refusal !== null;
    }
    if (found.refusal) say(found.refusal, true);
    list.replaceChildren(...found.recent.map((one) => row(one)));
    byId("batches", HTMLElement).replaceChildren(
      ...found.batches.map((batch) => batchTable(batch, (folder, at) => void choose(folder, at))),
    );
    if (!found.recent.length && !found.refusal) list.append(firstRow());
    if (document.activeElement === document.body) folder.focus();
  }

  /** Say what to do where no other session was opened before. */
  function firstRow() {
    const text = "No other session was opened before. Make one of your own videos and their calibration:";
    const title = "Make a session of videos and a calibration";
    const create = make("button", { type: "button", className: "is-primary", title, onclick: () => void showNew() }, "New session…");
    return make("li", "is-empty", text, create);
  }

  /** @param {Recent} session */
  function row({ folder, name, opened }) {
    const title = `Close this session and open ${folder}`;
    const open = make("button", { type: "button", title, onclick: () => void choose(folder) });
    const when = make("time", { dateTime: opened }, new Date(opened).toLocaleDateString([], { day: "numeric", month: "short" }));
    open.append(make("b", {}, name), when, make("small", "is-clipped", make("bdi", {}, folder)));
    return make("li", {}, open);
  }

  /**
   * @param {string} folder
   * @param {{frame?: number, person?: string}} at what it shows first
   */
  async function choose(folder, at = {}) {
    say("Checking…");
    try {
      await postJson("sessions/open", { folder, ...at }, (answer) => store.set({ opening: JSON.parse(answer).name }));
      panel.hidePopover();
    } catch (error) {
      say(error instanceof Error ? error.message : String(error), true);
      return;
    }
    const showStep = (/** @type {string} */ step) => store.set({ openingStep: step });
    if (await untilAnotherIsOpen(present, showStep)) {
      location.reload();
      return;
    }
    refuse(`Expected ${store.facts.opening} to be open by now. The terminal of the program says what is wrong.`);
    store.set({ opening: null, openingStep: "" });
  }

  /**
   * @param {string} text
   * @param {boolean} isFailure
   */
  function say(text, isFailure = false) {
    note.textContent = text;
    note.classList.toggle("is-failed", isFailure);
  }

  return { completes, toggle, showNew, showBoard };
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
