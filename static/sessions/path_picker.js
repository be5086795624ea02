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

/** @typedef {ReturnType<typeof makePathPicker>} PathPicker */

export function makePathPicker() {
  const dialog = byId("path-picker", HTMLDialogElement);
  const heading = byId("path-picker-title", HTMLElement);
  const field = byId("path-picker-path", HTMLInputElement);
  const entries = byId("path-picker-entries", HTMLElement);
  const note = byId("path-picker-note", HTMLOutputElement);
  const up = byId("path-picker-up", HTMLButtonElement);
  const chooser = byId("path-picker-choose", HTMLButtonElement);
  /** @type {Wanted} */
  let wanted = "folder";
  /** @type {FolderContents | null} */
  let contents = null;
  /** Files of the folder that are marked, by name. @type {Set<string>} */
  const marked = new Set();
  let take = (/** @type {string} */ _path) => {};

  onSubmit(byId("path-picker-form", HTMLFormElement), () => void go(field.value));
  up.addEventListener("click", () => contents?.parent && void go(contents.parent));
  entries.addEventListener("keydown", (event) => {
    if (event.key === "Backspace") up.click();
    else if (event.key === "ArrowDown" || event.key === "ArrowUp") moveFocus(entries, event.key === "ArrowDown" ? 1 : -1);
    else if (event.key !== " " || !toggleMark(document.activeElement)) return;
    event.preventDefault();
  });
  button("path-picker-cancel", () => dialog.close());
  chooser.addEventListener("click", () => contents && finish(chosen(contents.folder)));

  /**
   * Let the user choose.
   *
   * @param {Wanted} kind
   * @param {string} from a path to begin at; empty for the user's home
   * @param {(path: string) => void} taken called with the choice
   */
  function show(kind, from, taken) {
    wanted = kind;
    take = taken;
    heading.textContent = TITLES[kind];
    contents = null;
    entries.replaceChildren();
    dialog.showModal();
    void go(from).then((isThere) => !isThere && from && void go(""));
  }

  /**
   * Show a folder. Returns whether it could be read.
   *
   * @param {string} path
   */
  async function go(path) {
    const answer = await fetch(`sessions/folder?path=${encodeURIComponent(path)}`).catch(() => null);
    if (!answer?.ok) {
      note.textContent = (await answer?.text()) ?? "The program does not answer.";
      return false;
    }
    const found = (contents = /** @type {FolderContents} */ (await answer.json()));
    field.value = found.folder;
    up.disabled = found.parent === null;
    const isMarkable = wanted === "files" && found.entries.some(({ kind }) => kind === "file");
    const hint = isMarkable ? "Ctrl+click or Space marks several files." : "";
    note.textContent = found.is_cut_off ? "Not all entries are shown." : found.entries.length ? hint : "This folder is empty.";
    marked.clear();
    showMarked();
    entries.replaceChildren(...found.entries.map(row));
    entries.scrollTop = 0;
    /** @type {HTMLElement} */ (entries.querySelector("button:not(:disabled)") ?? entries).focus();
    return true;
  }

  /** @param {Entry} entry */
  function row(entry) {
    const { name, path, kind } = entry;
    const isFolder = kind === "folder" || kind === "session";
    const open = make("button", { type: "button", className: `is-${kind}`, title: isFolder ? `Open the folder ${name}` : `Choose ${name}` });
    // Files are listed where a folder is wanted, so that it can be recognized.
    open.disabled = !isFolder && (wanted === "folder" || (wanted === "footage" && kind !== "video"));
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
      if (isFolder) void go(path);
      else if (!(event.ctrlKey || event.metaKey) || !toggleMark(open)) finish(path);
    });
    return make("li", {}, open);
  }

  /**
   * Mark the file of an entry, or no longer. Returns whether it can be marked.
   *
   * @param {Element | null} entry
   */
  function toggleMark(entry) {
    const name = entry instanceof HTMLElement && wanted === "files" ? entry.dataset.name : "";
    if (!entry || !name) return false;
    if (!marked.delete(name)) marked.add(name);
    entry.setAttribute("aria-pressed", String(marked.has(name)));
    showMarked();
    return true;
  }

  function showMarked() {
    const count = marked.size;
    chooser.textContent = count ? `Choose ${count} ${count === 1 ? "file" : "files"}` : "Choose this folder";
    chooser.title = count ? "Choose the marked files" : "Choose the folder that is shown";
  }

  /**
   * The folder, or the marked files in it: the path of the first, and the names of the others.
   *
   * @param {string} folder
   */
  function chosen(folder) {
    return marked.size ? `${folder.replace(/\/$/, "")}/${[...marked].join("; ")}` : folder;
  }

  /** @param {string} path */
  function finish(path) {
    dialog.close();
    take(path);
  }

  return { show };
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
