/** Popover that exports the session to a file of another program, which the browser downloads. */

import { download } from "../widgets/downloads.js";
import { button, byId, make } from "../widgets/elements.js";
import { opensPopover, togglePopover } from "../widgets/popovers.js";
import { capital } from "../widgets/text.js";

const PROGRESS_MS = 400;

/** @typedef {{name: string, title: string, options: string[], axes: string, units: string, holds_provenance: boolean, numbering: string}} Format
 *   `numbering` is a sentence of a `{frame}` and its `{number}` in the file, or empty where they are the same
 */

/** @typedef {ReturnType<typeof mountExportPanel>} ExportPanel */

/**
 * @param {import("../model/store.js").Store} store
 * @param {import("../model/index.js").Context["say"]} say
 */
export function mountExportPanel(store, say) {
  const panel = byId("export-panel", HTMLElement);
  const open = byId("show-export", HTMLButtonElement);
  const format = byId("export-format", HTMLSelectElement);
  const person = byId("export-person", HTMLSelectElement);
  const view = byId("export-view", HTMLSelectElement);
  const frames = byId("export-frames", HTMLInputElement);
  const progress = byId("export-progress", HTMLOutputElement);
  /** @type {Format[]} */
  let known = [];
  /** @type {AbortController | null} the export in progress */
  let isRunning = null;
  opensPopover(panel, open, () => void toggle());
  const start = button("export-start", () => void run());
  const cancelButton = button("export-cancel", () => cancel());
  format.addEventListener("change", () => show());
  frames.addEventListener("keydown", (event) => event.key === "Enter" && void run());
  frames.addEventListener("input", () => showNumbering());
  for (const select of panel.querySelectorAll("select")) { // whose keys must not reach the page
    select.addEventListener("keydown", (event) => event.key !== "Escape" && event.stopPropagation());
  }

  /** Cancel the export in progress. */
  function cancel() {
    isRunning?.abort();
  }

  async function toggle() {
    if (!panel.matches(":popover-open")) {
      try {
        await fill();
      } catch {
        return say("The list of formats could not be loaded. Try again when the page is connected.", "error");
      }
    }
    togglePopover(panel, open);
  }

  /** Fill the choices of the session, and the marked range. */
  async function fill() {
    const answer = await fetch("export");
    if (!answer.ok) throw new Error(`status ${answer.status}`);
    known = await answer.json();
    const isSent = (/** @type {Format} */ { name }) => name.startsWith("like/");
    const sent = make("optgroup", { label: "Imported observations" }, ...known.filter(isSent).map(({ name, title }) => new Option(title, name)));
    const formats = known.filter((one) => !isSent(one)).map(({ name, title }) => new Option(capital(title), name));
    choices(format, sent.children.length ? [...formats, sent] : formats);
    const { session, range } = store.facts;
    const people = session?.people.map(({ name }) => new Option(name, name)) ?? [];
    const cameras = session?.cameras.map(({ name }) => new Option(name, name)) ?? [];
    choices(person, [new Option("Everyone", ""), ...people]);
    choices(view, [new Option("Grid of all", ""), ...cameras]);
    if (range) frames.value = `${range.first}-${range.last}`;
    show();
  }

  /** Show the options that the chosen format has. */
  function show() {
    const format = getChosen();
    const has = new Set(format?.options);
    if (has.has("only") && (store.facts.session?.people.length ?? 0) > 1) has.add("person");
    if (format && !format.holds_provenance) has.add("provenance");
    for (const part of panel.querySelectorAll("[data-option]")) {
      if (part instanceof HTMLElement) part.hidden = !has.has(part.dataset.option ?? "");
    }
    byId("export-axes", HTMLSelectElement).value = format?.axes || "calibration";
    byId("export-units", HTMLSelectElement).value = format?.units || "m";
    showNumbering();
  }

  /** Say how the file counts frames, of the first frame that is entered, else of frame 0. */
  function showNumbering() {
    const first = Number(/^\s*(\d{1,8})/.exec(frames.value)?.[1] ?? 0);
    const sentence = getChosen()?.numbering ?? "";
    byId("export-numbering", HTMLElement).textContent = sentence.replace("{frame}", String(first)).replace("{number}", String(first + 1));
  }

  function getChosen() {
    return known.find(({ name }) => name === format.value);
  }

  /** @returns {string | null} the address of the export; null, with the reason shown, if the frames are wrong */
  function addressOf() {
    const words = new URLSearchParams();
    for (const field of panel.querySelectorAll("select[data-option]")) {
      if (field instanceof HTMLSelectElement && !field.hidden && field.value) words.set(field.dataset.option ?? "", field.value);
    }
    const text = frames.value.trim();
    if (text && !frames.hidden) {
      const last = (store.facts.session?.n_frames ?? 1) - 1;
      const frames = framesOf(text, last);
      if (frames === null) {
        showMessage(`Expected frames within 0-${last}, such as 0-${Math.min(9, last)} or 0, ${last}, or nothing.`, true);
        return null;
      }
      words.set("frames", frames);
    }
    if (getChosen()?.options.includes("skip_lost") && byId("export-skip-lost", HTMLInputElement).checked) words.set("skip_lost", "1");
    if (!getChosen()?.holds_provenance && byId("export-provenance", HTMLInputElement).checked) words.set("provenance", "1");
    return `export/${format.value}?${words}`;
  }

  async function run() {
    if (isRunning) return;
    const address = addressOf();
    if (address === null) {
      frames.focus();
      return;
    }
    const running = (isRunning = new AbortController());
    start.disabled = true;
    cancelButton.hidden = false;
    showMessage("Exporting…");
    store.set({ exporting: 0 });
    const timer = setInterval(() => void showProgress(), PROGRESS_MS);
    try {
      const name = await download(address, running.signal);
      showMessage(`Saved ${name}`);
      say(`Exported ${name}.`);
    } catch (error) {
      if (running.signal.aborted) showMessage("Canceled");
      else {
        const reason = error instanceof TypeError ? "the program cannot be reached" : String(/** @type {Error} */ (error).message);
        showMessage(`Failed: ${reason}`, true);
        say(`Export failed: ${reason}`, "error");
      }
    } finally {
      clearInterval(timer);
      isRunning = null;
      store.set({ exporting: null });
      start.disabled = false;
      cancelButton.hidden = true;
    }
  }

  async function showProgress() {
    try {
      const { done, total } = await (await fetch("export/progress")).json();
      if (!isRunning || !total) return;
      showMessage(`Exporting, ${Math.floor((100 * done) / total)}%`);
      store.set({ exporting: done / total });
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
  function showMessage(text, isFailure = false) {
    progress.textContent = text;
    progress.classList.toggle("is-failed", isFailure);
  }


  return { cancel, toggle };
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
