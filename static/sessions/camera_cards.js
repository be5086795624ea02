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

/** @typedef {ReturnType<typeof makeCameraCards>} CameraCards */

/**
 * @param {() => void} changed called after a change by the user
 * @param {(from: string, take: (path: string) => void) => void} pick lets the user choose other footage
 */
export function makeCameraCards(changed, pick) {
  const list = byId("new-cameras", HTMLElement);
  const note = byId("new-cameras-note", HTMLElement);
  /** @type {Footage[]} */
  let files = [];
  /** @type {Map<string, Choice>} */
  let choices = new Map();

  /**
   * Show the cameras.
   *
   * @param {string[]} names
   * @param {Footage[]} all
   * @param {Record<string, string>} assigned footage by camera
   * @param {boolean} isKept whether choices of the user stay
   */
  function show(names, all, assigned, isKept) {
    const before = isKept ? choices : new Map();
    files = all;
    choices = new Map(
      names.map((name) => [name, before.get(name) ?? { footage: assigned[name] ?? "", side: name, offset: null }]),
    );
    draw();
  }

  /** The cameras that are used. @returns {CameraChoice[]} */
  function chosen() {
    const used = [...choices].filter(([, { footage }]) => footage);
    return used.map(([name, { footage, side, offset }]) => ({ name, footage, side_name: side, offset }));
  }

  /**
   * Exchange the footage of two cameras.
   *
   * @param {string} first
   * @param {string} second
   * @param {boolean} withSide whether backgrounds and masks go with the footage
   */
  function exchange(first, second, withSide) {
    const [a, b] = [choices.get(first), choices.get(second)];
    if (!a || !b || first === second) return;
    [a.footage, b.footage] = [b.footage, a.footage];
    [a.offset, b.offset] = [b.offset, a.offset];
    if (withSide) [a.side, b.side] = [b.side, a.side];
    draw();
    changed();
  }

  function draw() {
    const focused = document.activeElement instanceof HTMLElement ? document.activeElement.id : "";
    list.replaceChildren(...[...choices].map(([name, choice], index) => makeCard(name, choice, index)));
    if (focused) document.getElementById(focused)?.focus();
    const used = new Set([...choices.values()].map(({ footage }) => footage));
    const unused = files.filter(({ path }) => !used.has(path)).map(({ name }) => name);
    const out = [...choices].filter(([, { footage }]) => !footage).map(([name]) => name);
    const notes = [];
    if (out.length) notes.push(`Left out: ${listed(out)}.`);
    if (choices.size && unused.length) notes.push(`Not used: ${listed(unused)}.`);
    if (choices.size > 1) notes.push("Drag a picture onto another to exchange them.");
    note.textContent = notes.join(" ") || "Choose footage and calibration: the cameras appear here.";
  }

  /**
   * @param {string} name
   * @param {Choice} choice
   * @param {number} index
   */
  function makeCard(name, choice, index) {
    const card = make("li", { draggable: true });
    card.classList.toggle("is-left-out", !choice.footage);
    const picture = choice.footage ? firstFrame(name, choice.footage) : make("div", "no-picture", "No footage");
    const value = String(choice.offset ?? "");
    const title = `Offset of ${name}: number of frames that it began earlier than the others, such as 2 or 2.4. Empty: by the clocks of the footage, else 0`;
    const kind = { id: `new-offset-${index}`, type: "number", step: "any", placeholder: "auto", className: "query-field" };
    const offset = make("input", { ...kind, value, title, "aria-label": `Offset of ${name} in frames` });
    offset.addEventListener("change", () => {
      choice.offset = offset.value === "" ? null : Number(offset.value);
      changed();
    });
    card.append(picture, make("b", "is-clipped", name), footageMenu(name, choice, index), make("span", "with-unit", "Offset", offset, "frames"));
    listenToDrags(card, name);
    return card;
  }

  /**
   * @param {string} name
   * @param {Choice} choice
   * @param {number} index
   */
  function footageMenu(name, choice, index) {
    const menu = make("select", { id: `new-footage-${index}`, title: `Footage of ${name}. That of another camera is exchanged`, "aria-label": `Footage of ${name}` }, new Option("Leave out", ""));
    const isListed = files.some(({ path }) => path === choice.footage);
    if (choice.footage && !isListed) menu.append(new Option(choice.footage.split("/").pop(), choice.footage));
    for (const { path, name: file } of files) menu.append(new Option(file, path));
    menu.append(new Option("Other footage…", ELSEWHERE));
    menu.value = choice.footage;
    menu.addEventListener("change", () => {
      if (menu.value !== ELSEWHERE) return assign(name, menu.value);
      menu.value = choice.footage;
      pick(choice.footage, (path) => assign(name, path));
    });
    return menu;
  }

  /**
   * @param {string} name
   * @param {string} path
   */
  function assign(name, path) {
    const choice = choices.get(name);
    if (!choice) return;
    const other = path && [...choices.values()].find(({ footage }) => footage === path);
    if (other) other.footage = choice.footage;
    choice.footage = path;
    draw();
    changed();
  }

  /**
   * @param {HTMLElement} card
   * @param {string} name
   */
  function listenToDrags(card, name) {
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
      exchange(other, name, false);
    });
  }

  return { show, exchange, chosen };
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
