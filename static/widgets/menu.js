/** Menus that a button opens above itself: arrow keys move, Esc and a press elsewhere close. */

import { make } from "./elements.js";

/**
 * @typedef {{text: string, note: string, title: string, run: () => void, isDisabled?: boolean}} MenuItem note: the key, or a
 *   remark in small type
 */

export class Menu {
  #button;
  #menu;
  #list;

  /**
   * @param {HTMLButtonElement} opener
   * @param {HTMLElement} menu
   * @param {() => {items: MenuItem[], note?: string}} list returns what the menu offers now, with a sentence below it; without
   *   items it does not open
   */
  constructor(opener, menu, list) {
    this.#button = opener;
    this.#menu = menu;
    this.#list = list;
    opener.addEventListener("click", () => (menu.hidden ? this.#open() : this.#close()));
    menu.addEventListener("keydown", (event) => this.#key(event));
    addEventListener("pointerdown", (event) => {
      const at = /** @type {Node} */ (event.target);
      if (!menu.hidden && !menu.contains(at) && !opener.contains(at)) this.#close();
    });
    menu.addEventListener("focusout", (event) => {
      const to = /** @type {Node | null} */ (event.relatedTarget);
      if (to && !menu.contains(to) && to !== opener) this.#close();
    });
  }

  #open() {
    const { items, note } = this.#list();
    if (items.length === 0) return;
    const entries = items.map((item) => this.#entry(item));
    this.#menu.replaceChildren(...entries);
    if (note) this.#menu.append(make("p", {}, note));
    this.#menu.hidden = false;
    this.#button.setAttribute("aria-expanded", "true");
    const box = this.#button.getBoundingClientRect();
    this.#menu.style.left = `${Math.min(box.left, innerWidth - this.#menu.offsetWidth - 8)}px`;
    this.#menu.style.bottom = `${innerHeight - box.top + 4}px`;
    (entries.find((entry) => !entry.disabled) ?? this.#menu).focus();
  }

  /** @param {MenuItem} item */
  #entry({ text, note, title, run, isDisabled = false }) {
    const entry = make("button", { type: "button", role: "menuitem", title, disabled: isDisabled }, text, make("small", {}, note));
    entry.addEventListener("click", () => {
      this.#close();
      run();
    });
    return entry;
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
