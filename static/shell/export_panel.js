/** Popover that exports the session to a file of another program, which the browser downloads. */

import { download } from "../widgets/downloads.js";
import { button, byId, make } from "../widgets/elements.js";
import { opensPopover, togglePopover } from "../widgets/popovers.js";
import { capital } from "../widgets/text.js";

const PROGRESS_MS = 400;

/** @typedef {{name: string, title: string, options: string[], axes: string, units: string, holds_provenance: boolean, numbering: string}} Format
 *   `numbering` is a sentence of a `{frame}` and its `{number}` in the file, or empty where they are the same
 */

export class ExportPanel {
  #store;
  #notify;
  #panel = byId("export-panel", HTMLElement);
  #open = byId("show-export", HTMLButtonElement);
  #format = byId("export-format", HTMLSelectElement);
  #person = byId("export-person", HTMLSelectElement);
  #view = byId("export-view", HTMLSelectElement);
  #frames = byId("export-frames", HTMLInputElement);
  #progress = byId("export-progress", HTMLOutputElement);
  #start;
  #cancel;
  /** @type {Format[]} */
  #formats = [];
  /** @type {AbortController | null} the export in progress */
  #running = null;

  /**
   * @param {import("../model/store.js").Store} store
   * @param {(notice: import("../model/protocol.js").NoticeMessage) => void} notify
   */
  constructor(store, notify) {
    this.#store = store;
    this.#notify = notify;
    opensPopover(this.#panel, this.#open, () => void this.toggle());
    this.#start = button("export-start", () => void this.#run());
    this.#cancel = button("export-cancel", () => this.cancel());
    this.#format.addEventListener("change", () => this.#show());
    this.#frames.addEventListener("keydown", (event) => event.key === "Enter" && void this.#run());
    this.#frames.addEventListener("input", () => this.#showNumbering());
    for (const select of this.#panel.querySelectorAll("select")) { // whose keys must not reach the page
      select.addEventListener("keydown", (event) => event.key !== "Escape" && event.stopPropagation());
    }
  }

  /** Cancel the export in progress. */
  cancel() {
    this.#running?.abort();
  }

  async toggle() {
    if (!this.#panel.matches(":popover-open")) {
      try {
        await this.#fill();
      } catch {
        this.#say("error", "The list of formats could not be loaded. Try again when the page is connected.");
        return;
      }
    }
    togglePopover(this.#panel, this.#open);
  }

  /** Fill the choices of the session, and the marked range. */
  async #fill() {
    const answer = await fetch("export");
    if (!answer.ok) throw new Error(`status ${answer.status}`);
    this.#formats = await answer.json();
    const isSent = (/** @type {Format} */ { name }) => name.startsWith("like/");
    const sent = make("optgroup", { label: "Imported observations" }, ...this.#formats.filter(isSent).map(({ name, title }) => new Option(title, name)));
    const formats = this.#formats.filter((one) => !isSent(one)).map(({ name, title }) => new Option(capital(title), name));
    choices(this.#format, sent.children.length ? [...formats, sent] : formats);
    const { session, range } = this.#store.facts;
    const people = session?.people.map(({ name }) => new Option(name, name)) ?? [];
    const cameras = session?.cameras.map(({ name }) => new Option(name, name)) ?? [];
    choices(this.#person, [new Option("Everyone", ""), ...people]);
    choices(this.#view, [new Option("Grid of all", ""), ...cameras]);
    if (range) this.#frames.value = `${range.first}-${range.last}`;
    this.#show();
  }

  /** Show the options that the chosen format has. */
  #show() {
    const format = this.#chosen;
    const has = new Set(format?.options);
    if (has.has("only") && (this.#store.facts.session?.people.length ?? 0) > 1) has.add("person");
    if (format && !format.holds_provenance) has.add("provenance");
    for (const part of this.#panel.querySelectorAll("[data-option]")) {
      if (part instanceof HTMLElement) part.hidden = !has.has(part.dataset.option ?? "");
    }
    byId("export-axes", HTMLSelectElement).value = format?.axes || "calibration";
    byId("export-units", HTMLSelectElement).value = format?.units || "m";
    this.#showNumbering();
  }

  /** Say how the file counts frames, of the first frame that is entered, else of frame 0. */
  #showNumbering() {
    const first = Number(/^\s*(\d{1,8})/.exec(this.#frames.value)?.[1] ?? 0);
    const sentence = this.#chosen?.numbering ?? "";
    byId("export-numbering", HTMLElement).textContent = sentence.replace("{frame}", String(first)).replace("{number}", String(first + 1));
  }

  get #chosen() {
    return this.#formats.find(({ name }) => name === this.#format.value);
  }

  /** @returns {string | null} the address of the export; null, with the reason shown, if the frames are wrong */
  #address() {
    const words = new URLSearchParams();
    for (const field of this.#panel.querySelectorAll("select[data-option]")) {
      if (field instanceof HTMLSelectElement && !field.hidden && field.value) words.set(field.dataset.option ?? "", field.value);
    }
    const text = this.#frames.value.trim();
    if (text && !this.#frames.hidden) {
      const last = (this.#store.facts.session?.n_frames ?? 1) - 1;
      const frames = framesOf(text, last);
      if (frames === null) {
        this.#showMessage(`Expected frames within 0-${last}, such as 0-${Math.min(9, last)} or 0, ${last}, or nothing.`, true);
        return null;
      }
      words.set("frames", frames);
    }
    if (this.#chosen?.options.includes("skip_lost") && byId("export-skip-lost", HTMLInputElement).checked) words.set("skip_lost", "1");
    if (!this.#chosen?.holds_provenance && byId("export-provenance", HTMLInputElement).checked) words.set("provenance", "1");
    return `export/${this.#format.value}?${words}`;
  }

  async #run() {
    if (this.#running) return;
    const address = this.#address();
    if (address === null) {
      this.#frames.focus();
      return;
    }
    const running = (this.#running = new AbortController());
    this.#start.disabled = true;
    this.#cancel.hidden = false;
    this.#showMessage("Exporting…");
    this.#store.set({ exporting: 0 });
    const timer = setInterval(() => void this.#showProgress(), PROGRESS_MS);
    try {
      const name = await download(address, running.signal);
      this.#showMessage(`Saved ${name}`);
      this.#say("info", `Exported ${name}.`);
    } catch (error) {
      if (running.signal.aborted) this.#showMessage("Canceled");
      else {
        const reason = error instanceof TypeError ? "the program cannot be reached" : String(/** @type {Error} */ (error).message);
        this.#showMessage(`Failed: ${reason}`, true);
        this.#say("error", `Export failed: ${reason}`);
      }
    } finally {
      clearInterval(timer);
      this.#running = null;
      this.#store.set({ exporting: null });
      this.#start.disabled = false;
      this.#cancel.hidden = true;
    }
  }

  async #showProgress() {
    try {
      const { done, total } = await (await fetch("export/progress")).json();
      if (!this.#running || !total) return;
      this.#showMessage(`Exporting, ${Math.floor((100 * done) / total)}%`);
      this.#store.set({ exporting: done / total });
    } catch {
      // The export itself reports that the program cannot be reached.
    }
  }

  /**
   * Show a line in the panel, which covers the notices.
   *
   * @param {string} text
   * @param {boolean} isFailure
   */
  #showMessage(text, isFailure = false) {
    this.#progress.textContent = text;
    this.#progress.classList.toggle("is-failed", isFailure);
  }

  /**
   * @param {"error" | "info"} level
   * @param {string} text
   */
  #say(level, text) {
    this.#notify({ type: "notice", level, text });
  }
}

/**
 * Replace the options of a select, and keep what was chosen if it is still there.
 *
 * @param {HTMLSelectElement} select
 * @param {(HTMLOptionElement | HTMLOptGroupElement)[]} options
 */
function choices(select, options) {
  const chosen = select.value;
  select.replaceChildren(...options);
  if ([...select.options].some(({ value }) => value === chosen)) select.value = chosen;
}

/**
 * @param {string} text frames as entered, first and last or a list
 * @param {number} last frame of the session
 * @returns {string | null} the same for the server; null if they are none of the session
 */
function framesOf(text, last) {
  const ends = /^(\d{1,8})(?:\s*[-–]\s*(\d{1,8}))?$/.exec(text);
  if (ends) {
    const [from, to] = [Number(ends[1]), Number(ends[2] ?? ends[1])];
    return from <= to && to <= last ? `${from}:${to + 1}` : null;
  }
  const words = text.split(",").map((word) => word.trim());
  return words.every((word) => /^\d{1,8}$/.test(word) && Number(word) <= last) ? words.join(",") : null;
}
