/** Dialog that chooses a file or folder of the program's machine. */

import { button, byId, make, onSubmit } from "../widgets/elements.js";

/**
 * @typedef {{name: string, path: string, kind: "folder" | "session" | "video" | "file"}} Entry
 * @typedef {{folder: string, parent: string | null, entries: Entry[], is_cut_off: boolean}} FolderContents
 * @typedef {"folder" | "files" | "footage"} Wanted kind of the choice; files are one, several or their folder; footage is a
 *   video, or a folder of images
 */

const TITLES = { folder: "Choose a folder", files: "Choose a file, several files or a folder", footage: "Choose a video or a folder of images" };
const MARKS = { folder: "▸", session: "▸", video: "", file: "" };

export class PathPicker {
  #dialog = byId("path-picker", HTMLDialogElement);
  #title = byId("path-picker-title", HTMLElement);
  #path = byId("path-picker-path", HTMLInputElement);
  #list = byId("path-picker-entries", HTMLElement);
  #note = byId("path-picker-note", HTMLOutputElement);
  #up = byId("path-picker-up", HTMLButtonElement);
  #choose = byId("path-picker-choose", HTMLButtonElement);
  /** @type {Wanted} */
  #wanted = "folder";
  /** @type {FolderContents | null} */
  #contents = null;
  /** Files of the folder that are marked, by name. @type {Set<string>} */
  #marked = new Set();
  #take = (/** @type {string} */ _path) => {};

  constructor() {
    onSubmit(byId("path-picker-form", HTMLFormElement), () => void this.#go(this.#path.value));
    this.#up.addEventListener("click", () => this.#contents?.parent && void this.#go(this.#contents.parent));
    this.#list.addEventListener("keydown", (event) => {
      if (event.key === "Backspace") this.#up.click();
      else if (event.key === "ArrowDown" || event.key === "ArrowUp") moveFocus(this.#list, event.key === "ArrowDown" ? 1 : -1);
      else if (event.key !== " " || !this.#mark(document.activeElement)) return;
      event.preventDefault();
    });
    button("path-picker-cancel", () => this.#dialog.close());
    this.#choose.addEventListener("click", () => this.#contents && this.#finish(this.#chosen(this.#contents.folder)));
  }

  /**
   * Let the user choose.
   *
   * @param {Wanted} wanted
   * @param {string} from a path to begin at; empty for the user's home
   * @param {(path: string) => void} take called with the choice
   */
  show(wanted, from, take) {
    this.#wanted = wanted;
    this.#take = take;
    this.#title.textContent = TITLES[wanted];
    this.#contents = null;
    this.#list.replaceChildren();
    this.#dialog.showModal();
    void this.#go(from).then((isThere) => !isThere && from && void this.#go(""));
  }

  /**
   * Show a folder. Returns whether it could be read.
   *
   * @param {string} path
   */
  async #go(path) {
    const answer = await fetch(`sessions/folder?path=${encodeURIComponent(path)}`).catch(() => null);
    if (!answer?.ok) {
      this.#note.textContent = (await answer?.text()) ?? "The program does not answer.";
      return false;
    }
    /** @type {FolderContents} */
    const contents = await answer.json();
    this.#contents = contents;
    this.#path.value = contents.folder;
    this.#up.disabled = contents.parent === null;
    const isMarkable = this.#wanted === "files" && contents.entries.some(({ kind }) => kind === "file");
    const hint = isMarkable ? "Ctrl+click or Space marks several files." : "";
    this.#note.textContent = contents.is_cut_off ? "Not all entries are shown." : contents.entries.length ? hint : "This folder is empty.";
    this.#marked.clear();
    this.#showMarked();
    this.#list.replaceChildren(...contents.entries.map((entry) => this.#row(entry)));
    this.#list.scrollTop = 0;
    /** @type {HTMLElement} */ (this.#list.querySelector("button:not(:disabled)") ?? this.#list).focus();
    return true;
  }

  /** @param {Entry} entry */
  #row(entry) {
    const { name, path, kind } = entry;
    const isFolder = kind === "folder" || kind === "session";
    const open = make("button", { type: "button", className: `is-${kind}`, title: isFolder ? `Open the folder ${name}` : `Choose ${name}` });
    // Files are listed where a folder is wanted, so that it can be recognized.
    open.disabled = !isFolder && (this.#wanted === "folder" || (this.#wanted === "footage" && kind !== "video"));
    if (kind === "video") {
      const picture = make("img", { alt: "", loading: "lazy", src: previewOf(path) });
      picture.addEventListener("error", () => picture.removeAttribute("src"));
      open.append(picture);
    } else {
      open.append(make("i", {}, MARKS[kind]));
    }
    open.append(make("span", {}, name));
    if (kind === "session") open.append(make("small", {}, "session"));
    open.dataset.name = isFolder ? "" : name;
    open.addEventListener("click", (event) => {
      if (isFolder) void this.#go(path);
      else if (!(event.ctrlKey || event.metaKey) || !this.#mark(open)) this.#finish(path);
    });
    return make("li", {}, open);
  }

  /**
   * Mark the file of an entry, or no longer. Returns whether it can be marked.
   *
   * @param {Element | null} entry
   */
  #mark(entry) {
    const name = entry instanceof HTMLElement && this.#wanted === "files" ? entry.dataset.name : "";
    if (!entry || !name) return false;
    if (!this.#marked.delete(name)) this.#marked.add(name);
    entry.setAttribute("aria-pressed", String(this.#marked.has(name)));
    this.#showMarked();
    return true;
  }

  #showMarked() {
    const count = this.#marked.size;
    this.#choose.textContent = count ? `Choose ${count} ${count === 1 ? "file" : "files"}` : "Choose this folder";
    this.#choose.title = count ? "Choose the marked files" : "Choose the folder that is shown";
  }

  /**
   * The folder, or the marked files in it: the path of the first, and the names of the others.
   *
   * @param {string} folder
   */
  #chosen(folder) {
    return this.#marked.size ? `${folder.replace(/\/$/, "")}/${[...this.#marked].join("; ")}` : folder;
  }

  /** @param {string} path */
  #finish(path) {
    this.#dialog.close();
    this.#take(path);
  }
}

/**
 * Address of a small picture of a video or a folder of images.
 *
 * @param {string} path
 */
export function previewOf(path) {
  return `sessions/preview?path=${encodeURIComponent(path)}`;
}

/**
 * @param {HTMLElement} list
 * @param {number} step
 */
function moveFocus(list, step) {
  const buttons = /** @type {HTMLButtonElement[]} */ ([...list.querySelectorAll("button:not(:disabled)")]);
  const at = buttons.findIndex((one) => one === document.activeElement);
  buttons[Math.max(0, Math.min(buttons.length - 1, at + step))]?.focus();
}
