/** Popover that opens another session: a recent one, or a folder by its path, which is completed as the user types. */

import { byId } from "../widgets/elements.js";
import { opensPopover, togglePopover } from "../widgets/popovers.js";

/** Wait for a pause in typing before paths are completed. */
const PAUSE_MS = 120;
const POLL_MS = 300;

/** @typedef {{refusal: string | null, folder: string, recent: {folder: string, name: string, opened: string}[]}} Listed */

export class Sessions {
  #panel = byId("sessions-panel", HTMLElement);
  #open = byId("session-name", HTMLButtonElement);
  #folder = byId("session-folder", HTMLInputElement);
  #list = byId("recent-sessions", HTMLElement);
  #note = byId("sessions-note", HTMLOutputElement);
  #form = byId("open-session", HTMLFormElement);

  #store;
  /** Folder of the open session. */
  #present = "";

  /** @param {import("../model/store.js").Store} store */
  constructor(store) {
    this.#store = store;
    opensPopover(this.#panel, this.#open, () => this.toggle());
    this.#form.addEventListener("submit", (event) => {
      event.preventDefault();
      void this.#choose(this.#folder.value);
    });
    completePaths(this.#folder, byId("session-folders", HTMLDataListElement));
    /** @type {string | undefined} */
    let first;
    store.subscribe((changed) => {
      if (!changed.has("session")) return;
      first ??= store.facts.session?.name;
      // Another page has opened another session: everything here belongs to the former one.
      if (first !== store.facts.session?.name) location.reload();
    });
  }

  toggle() {
    togglePopover(this.#panel, this.#open);
    if (!this.#panel.matches(":popover-open")) return;
    this.#say("");
    this.#folder.focus();
    void this.#fill();
  }

  async #fill() {
    /** @type {Listed} */
    let listed = { refusal: "The program does not answer.", folder: "", recent: [] };
    try {
      listed = await (await fetch("sessions")).json();
    } catch {
      // Said in the panel.
    }
    this.#present = listed.folder;
    for (const control of this.#form.elements) /** @type {HTMLInputElement} */ (control).disabled = listed.refusal !== null;
    if (listed.refusal) this.#say(listed.refusal, true);
    this.#list.replaceChildren(...listed.recent.map((one) => this.#row(one)));
    if (!listed.recent.length && !listed.refusal) this.#say("No other session was opened before.");
    if (document.activeElement === document.body) this.#folder.focus();
  }

  /** @param {Listed["recent"][number]} session */
  #row({ folder, name, opened }) {
    const item = document.createElement("li");
    const open = document.createElement("button");
    open.type = "button";
    open.title = `Close this session and open ${folder}`;
    const where = document.createElement("small");
    where.append(Object.assign(document.createElement("bdi"), { textContent: folder }));
    const when = document.createElement("time");
    when.dateTime = opened;
    when.textContent = new Date(opened).toLocaleDateString([], { day: "numeric", month: "short" });
    const title = document.createElement("b");
    title.textContent = name;
    open.append(title, when, where);
    open.addEventListener("click", () => void this.#choose(folder));
    item.append(open);
    return item;
  }

  /** @param {string} folder */
  async #choose(folder) {
    this.#say("Checking…");
    try {
      const answer = await postJson("sessions/open", { folder });
      const { name } = JSON.parse(answer);
      this.#store.set({ opening: name });
      this.#panel.hidePopover();
    } catch (error) {
      this.#say(error instanceof Error ? error.message : String(error), true);
      return;
    }
    await untilAnotherIsOpen(this.#present);
    location.reload();
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
 * Wait until the program has been replaced by one that serves another session.
 *
 * @param {string} present folder of the session that is being closed
 */
async function untilAnotherIsOpen(present) {
  for (;;) {
    await new Promise((resolve) => setTimeout(resolve, POLL_MS));
    try {
      const { folder } = await (await fetch("sessions")).json();
      if (folder !== present) return;
    } catch {
      // The program is starting.
    }
  }
}

/**
 * Complete the path in a field as the user types.
 *
 * @param {HTMLInputElement} field
 * @param {HTMLDataListElement} list of the field
 */
function completePaths(field, list) {
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let timer;
  field.addEventListener("input", () => {
    clearTimeout(timer);
    timer = setTimeout(async () => {
      const text = field.value;
      try {
        const found = await (await fetch(`sessions/paths?text=${encodeURIComponent(text)}`)).json();
        if (field.value !== text) return;
        list.replaceChildren(
          ...found.map((/** @type {{path: string, is_session: boolean}} */ { path, is_session }) => {
            const option = new Option("", path);
            if (is_session) option.label = "session";
            return option;
          }),
        );
      } catch {
        // Completion is a convenience; opening says what is wrong.
      }
    }, PAUSE_MS);
  });
}

/**
 * Send JSON to the program. Returns the text of the answer.
 *
 * @param {string} address
 * @param {unknown} body
 */
async function postJson(address, body) {
  const headers = { "Content-Type": "application/json" };
  let answer;
  try {
    answer = await fetch(address, { method: "POST", headers, body: JSON.stringify(body) });
  } catch {
    throw new Error("The program does not answer.");
  }
  const text = await answer.text();
  if (!answer.ok) throw new Error(text);
  return text;
}
