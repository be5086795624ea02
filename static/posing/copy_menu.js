/** Menu of poses to copy: of other people, of the neighbouring frames and of the nearest keyframes. */

import { personCells } from "../model/selectors.js";
import { byId } from "../widgets/elements.js";

const MAX_KEYFRAMES = 12;

export class CopyMenu {
  #store;
  #posing;
  #button = byId("copy-pose", HTMLButtonElement);
  #menu = byId("copy-menu", HTMLElement);

  /**
   * @param {import("../model/store.js").Store} store
   * @param {import("./posing.js").Posing} posing
   */
  constructor(store, posing) {
    this.#store = store;
    this.#posing = posing;
    this.#button.addEventListener("click", () => (this.#menu.hidden ? this.#open() : this.#close()));
    this.#menu.addEventListener("keydown", (event) => this.#key(event));
    addEventListener("pointerdown", (event) => {
      const at = /** @type {Node} */ (event.target);
      if (!this.#menu.hidden && !this.#menu.contains(at) && !this.#button.contains(at)) this.#close();
    });
    this.#menu.addEventListener("focusout", (event) => {
      const to = /** @type {Node | null} */ (event.relatedTarget);
      if (to && !this.#menu.contains(to) && to !== this.#button) this.#close();
    });
  }

  #open() {
    const { shown, session, state } = this.#store.facts;
    if (!shown || !session) return;
    const here = shown.frame;
    const cells = personCells(this.#store.facts);
    const keyframes = [...cells]
      .filter(([frame, cell]) => cell.keyframe && frame !== here)
      .map(([frame]) => frame)
      .sort((a, b) => Math.abs(a - here) - Math.abs(b - here))
      .slice(0, MAX_KEYFRAMES)
      .sort((a, b) => a - b);
    const others = [...session.people.entries()].filter(([person]) => person !== (state?.person ?? 0));
    const items = [
      ...others.map(([person, { name }]) => this.#ofPerson(name, person)),
      this.#item("Previous frame", "Alt+,", here - 1, cells.has(here - 1)),
      this.#item("Next frame", "Alt+.", here + 1, cells.has(here + 1)),
      ...keyframes.map((frame) => this.#item(`Keyframe ${frame}`, away(frame - here), frame, true)),
    ];
    this.#menu.replaceChildren(...items);
    if (keyframes.length === 0) {
      const none = document.createElement("p");
      none.textContent = "No other keyframes. A frame becomes a keyframe when you edit its pose.";
      this.#menu.append(none);
    }
    this.#menu.hidden = false;
    this.#button.setAttribute("aria-expanded", "true");
    const box = this.#button.getBoundingClientRect();
    this.#menu.style.left = `${Math.min(box.left, innerWidth - this.#menu.offsetWidth - 8)}px`;
    this.#menu.style.bottom = `${innerHeight - box.top + 4}px`;
    (items.find((item) => !item.disabled) ?? this.#menu).focus();
  }

  /**
   * @param {string} text
   * @param {string} note
   * @param {number} frame
   * @param {boolean} hasPose
   */
  #item(text, note, frame, hasPose) {
    const title = hasPose ? `Copy the pose of frame ${frame}` : `Frame ${frame} has no pose`;
    const item = this.#entry(text, hasPose ? note : "no pose", title, () => this.#posing.copyFrom(frame));
    item.disabled = !hasPose;
    return item;
  }

  /**
   * @param {string} name
   * @param {number} person
   */
  #ofPerson(name, person) {
    const title = `Copy the joint angles of ${name}; position and orientation stay`;
    return this.#entry(name, "this frame", title, () => this.#posing.copyPerson(person));
  }

  /**
   * @param {string} text
   * @param {string} note
   * @param {string} title
   * @param {() => void} copy
   */
  #entry(text, note, title, copy) {
    const item = document.createElement("button");
    item.type = "button";
    item.setAttribute("role", "menuitem");
    item.title = title;
    const small = document.createElement("small");
    small.textContent = note;
    item.append(text, small);
    item.addEventListener("click", () => {
      this.#close();
      copy();
    });
    return item;
  }

  #close() {
    const hadFocus = this.#menu.contains(document.activeElement);
    this.#menu.hidden = true;
    this.#button.setAttribute("aria-expanded", "false");
    if (hadFocus) this.#button.focus();
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    const items = [...this.#menu.querySelectorAll("button")].filter((item) => !item.disabled);
    const at = items.indexOf(/** @type {HTMLButtonElement} */ (document.activeElement));
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (event.key === "Escape") this.#close();
    else if (step) items[(at + step + items.length) % items.length]?.focus();
    else return;
    event.preventDefault();
  }
}

/** @param {number} frames */
function away(frames) {
  return frames < 0 ? `${-frames} earlier` : `${frames} later`;
}
