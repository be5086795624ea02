/** Dialog that makes a session of videos and a calibration. The program's checks are listed as they pass. */

import { byId } from "../widgets/elements.js";
import { completePaths, postJson } from "./session_requests.js";

/** @typedef {{passed?: string, warning?: string, failed?: string, made?: string}} Line */

export class NewSession {
  #dialog = byId("new-session", HTMLDialogElement);
  #form = byId("new-session-form", HTMLFormElement);
  #checks = byId("new-session-checks", HTMLElement);
  #make = byId("make-session", HTMLButtonElement);
  #openIt = byId("open-made-session", HTMLButtonElement);
  /** Folder of the session that was made; empty before. */
  #made = "";

  /** @param {(folder: string) => void} open opens a session */
  constructor(open) {
    this.#form.addEventListener("submit", (event) => {
      event.preventDefault();
      void this.#run();
    });
    this.#form.addEventListener("input", () => this.#begin());
    byId("cancel-new-session", HTMLButtonElement).addEventListener("click", () => this.#dialog.close());
    this.#openIt.addEventListener("click", () => {
      this.#dialog.close();
      open(this.#made);
    });
    for (const field of this.#form.querySelectorAll("input[list]")) {
      const input = /** @type {HTMLInputElement} */ (field);
      completePaths(input, /** @type {HTMLDataListElement} */ (input.list));
    }
  }

  show() {
    this.#dialog.showModal();
    this.#begin();
  }

  /** Forget the outcome of the last attempt. */
  #begin() {
    this.#made = "";
    this.#openIt.hidden = true;
    this.#make.hidden = false;
    this.#checks.replaceChildren();
  }

  async #run() {
    this.#begin();
    this.#make.disabled = true;
    try {
      await postJson("sessions/new", this.#request(), (line) => this.#showLine(JSON.parse(line)));
    } catch (error) {
      this.#add("is-failed", error instanceof Error ? error.message : String(error));
    }
    this.#make.disabled = false;
    this.#make.hidden = this.#made !== "";
    this.#openIt.hidden = this.#made === "";
    if (this.#made) this.#openIt.focus();
  }

  #request() {
    const values = /** @type {Record<string, string>} */ (Object.fromEntries(new FormData(this.#form)));
    const optional = (/** @type {string} */ text) => text.trim() || null;
    const number = (/** @type {string} */ text) => (text.trim() ? Number(text) : null);
    const list = (/** @type {string} */ text) => text.split(",").map((part) => part.trim()).filter(Boolean);
    return {
      folder: values.folder,
      calibration: values.calibration,
      footage: values.footage,
      people: list(values.people),
      heights_m: list(values.heights).map((height) => Number(height) / 100),
      up: values.up,
      units: optional(values.units),
      fps: number(values.fps),
      background: optional(values.background),
    }; // prettier-ignore
  }

  /** @param {Line} line */
  #showLine({ passed, warning, failed, made }) {
    if (passed) this.#add("is-passed", passed);
    if (warning) this.#add("is-warning", warning);
    if (failed) this.#add("is-failed", failed);
    if (!made) return;
    this.#made = made;
    this.#add("is-passed", `The session is in ${made}.`);
  }

  /**
   * @param {string} kind
   * @param {string} text
   */
  #add(kind, text) {
    this.#checks.append(Object.assign(document.createElement("li"), { className: kind, textContent: text }));
    this.#checks.lastElementChild?.scrollIntoView({ block: "nearest" });
  }
}
