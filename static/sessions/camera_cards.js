/** Cards of the calibrated cameras in the form of a new session: footage with a picture, and the offset of each. */

import { byId, make } from "../widgets/elements.js";
import { previewOf } from "./path_picker.js";

/**
 * @typedef {{path: string, name: string}} Footage
 * @typedef {{footage: string, side: string, offset: number | null}} Choice footage is empty where the camera is left out; side is
 *   the name after which background and masks are filed
 * @typedef {{name: string, footage: string, side_name: string, offset: number | null}} CameraChoice
 */

const ELSEWHERE = "\0";
const DRAGGED = "application/x-quadrille-camera";

export class CameraCards {
  #list = byId("new-cameras", HTMLElement);
  #note = byId("new-cameras-note", HTMLElement);
  #changed;
  #pick;
  /** @type {Footage[]} */
  #files = [];
  /** @type {Map<string, Choice>} */
  #choices = new Map();

  /**
   * @param {() => void} changed called after a change by the user
   * @param {(from: string, take: (path: string) => void) => void} pick lets the user choose other footage
   */
  constructor(changed, pick) {
    this.#changed = changed;
    this.#pick = pick;
  }

  /**
   * Show the cameras.
   *
   * @param {string[]} names
   * @param {Footage[]} files
   * @param {Record<string, string>} assigned footage by camera
   * @param {boolean} isKept whether choices of the user stay
   */
  show(names, files, assigned, isKept) {
    const before = isKept ? this.#choices : new Map();
    this.#files = files;
    this.#choices = new Map(
      names.map((name) => [name, before.get(name) ?? { footage: assigned[name] ?? "", side: name, offset: null }]),
    );
    this.#draw();
  }

  /** The cameras that are used. @returns {CameraChoice[]} */
  get chosen() {
    return [...this.#choices]
      .filter(([, { footage }]) => footage)
      .map(([name, { footage, side, offset }]) => ({ name, footage, side_name: side, offset }));
  }

  /**
   * Exchange the footage of two cameras.
   *
   * @param {string} first
   * @param {string} second
   * @param {boolean} withSide whether backgrounds and masks go with the footage
   */
  exchange(first, second, withSide) {
    const [a, b] = [this.#choices.get(first), this.#choices.get(second)];
    if (!a || !b || first === second) return;
    [a.footage, b.footage] = [b.footage, a.footage];
    [a.offset, b.offset] = [b.offset, a.offset];
    if (withSide) [a.side, b.side] = [b.side, a.side];
    this.#draw();
    this.#changed();
  }

  #draw() {
    const focused = document.activeElement instanceof HTMLElement ? document.activeElement.id : "";
    this.#list.replaceChildren(...[...this.#choices].map(([name, choice], index) => this.#card(name, choice, index)));
    if (focused) document.getElementById(focused)?.focus();
    const used = new Set([...this.#choices.values()].map(({ footage }) => footage));
    const unused = this.#files.filter(({ path }) => !used.has(path)).map(({ name }) => name);
    const out = [...this.#choices].filter(([, { footage }]) => !footage).map(([name]) => name);
    const notes = [];
    if (out.length) notes.push(`Left out: ${listed(out)}.`);
    if (this.#choices.size && unused.length) notes.push(`Not used: ${listed(unused)}.`);
    if (this.#choices.size > 1) notes.push("Drag a picture onto another to exchange them.");
    this.#note.textContent = notes.join(" ") || "Choose footage and calibration: the cameras appear here.";
  }

  /**
   * @param {string} name
   * @param {Choice} choice
   * @param {number} index
   */
  #card(name, choice, index) {
    const card = make("li", { draggable: true });
    card.classList.toggle("is-left-out", !choice.footage);
    const picture = choice.footage ? firstFrame(name, choice.footage) : make("div", "no-picture", "No footage");
    const value = String(choice.offset ?? "");
    const title = `Offset of ${name}: number of frames that it began earlier than the others, such as 2 or 2.4. Empty: by the clocks of the footage, else 0`;
    const kind = { id: `new-offset-${index}`, type: "number", step: "any", placeholder: "auto", className: "query-field" };
    const offset = make("input", { ...kind, value, title, "aria-label": `Offset of ${name} in frames` });
    offset.addEventListener("change", () => {
      choice.offset = offset.value === "" ? null : Number(offset.value);
      this.#changed();
    });
    card.append(picture, make("b", "is-clipped", name), this.#menu(name, choice, index), make("span", "with-unit", "Offset", offset, "frames"));
    this.#listenToDrags(card, name);
    return card;
  }

  /**
   * @param {string} name
   * @param {Choice} choice
   * @param {number} index
   */
  #menu(name, choice, index) {
    const menu = make("select", { id: `new-footage-${index}`, title: `Footage of ${name}. That of another camera is exchanged`, "aria-label": `Footage of ${name}` }, new Option("Leave out", ""));
    const isListed = this.#files.some(({ path }) => path === choice.footage);
    if (choice.footage && !isListed) menu.append(new Option(choice.footage.split("/").pop(), choice.footage));
    for (const { path, name: file } of this.#files) menu.append(new Option(file, path));
    menu.append(new Option("Other footage…", ELSEWHERE));
    menu.value = choice.footage;
    menu.addEventListener("change", () => {
      const path = menu.value;
      if (path === ELSEWHERE) {
        menu.value = choice.footage;
        this.#pick(choice.footage, (chosen) => this.#assign(name, chosen));
      } else {
        this.#assign(name, path);
      }
    });
    return menu;
  }

  /**
   * @param {string} name
   * @param {string} path
   */
  #assign(name, path) {
    const choice = this.#choices.get(name);
    if (!choice) return;
    const other = path && [...this.#choices.values()].find(({ footage }) => footage === path);
    if (other) other.footage = choice.footage;
    choice.footage = path;
    this.#draw();
    this.#changed();
  }

  /**
   * @param {HTMLElement} card
   * @param {string} name
   */
  #listenToDrags(card, name) {
    const isCamera = (/** @type {DragEvent} */ event) => event.dataTransfer?.types.includes(DRAGGED);
    card.addEventListener("dragstart", (event) => event.dataTransfer?.setData(DRAGGED, name));
    card.addEventListener("dragover", (event) => {
      if (!isCamera(event)) return;
      event.preventDefault();
      card.classList.add("is-target");
    });
    card.addEventListener("dragleave", () => card.classList.remove("is-target"));
    card.addEventListener("drop", (event) => {
      card.classList.remove("is-target");
      const other = event.dataTransfer?.getData(DRAGGED);
      if (!other) return;
      event.preventDefault();
      this.exchange(other, name, false);
    });
  }
}

/** @param {string[]} names */
function listed(names) {
  return names.length > 6 ? `${names.slice(0, 6).join(", ")} and ${names.length - 6} more` : names.join(", ");
}

/**
 * @param {string} camera
 * @param {string} footage
 */
function firstFrame(camera, footage) {
  const picture = make("img", { alt: `First frame of ${camera}`, src: previewOf(footage), draggable: false, title: "Drag onto another camera to exchange their footage" });
  picture.addEventListener("error", () => picture.replaceWith(make("div", "no-picture", "Cannot be read")));
  return picture;
}
