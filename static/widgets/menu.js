/** Menus that a button opens above itself: arrow keys move, Esc and a press elsewhere close. */

import { make } from "./elements.js";

/**
 * @typedef {{text: string, note: string, title: string, run: () => void, isDisabled?: boolean}} MenuItem note: the key, or a
 *   remark in small type
 */

/**
 * @param {HTMLButtonElement} opener
 * @param {HTMLElement} menu
 * @param {() => {items: MenuItem[], note?: string}} list returns what the menu offers now, with a sentence below it; without
 *   items it does not open
 */
export function mountMenu(opener, menu, list) {
  const button = opener;
  opener.addEventListener("click", () => (menu.hidden ? open() : close()));
  menu.addEventListener("keydown", (event) => key(event));
  addEventListener("pointerdown", (event) => {
    const at = /** @type {Node} */ (event.target);
    if (!menu.hidden && !menu.contains(at) && !opener.contains(at)) close();
  });
  menu.addEventListener("focusout", (event) => {
    const to = /** @type {Node | null} */ (event.relatedTarget);
    if (to && !menu.contains(to) && to !== opener) close();
  });

  function open() {
    const { items, note } = list();
    if (items.length === 0) return;
    const entries = items.map((item) => makeEntry(item));
    menu.replaceChildren(...entries);
    if (note) menu.append(make("p", {}, note));
    menu.hidden = false;
    button.setAttribute("aria-expanded", "true");
    const box = button.getBoundingClientRect();
    menu.style.left = `${Math.min(box.left, innerWidth - menu.offsetWidth - 8)}px`;
    menu.style.bottom = `${innerHeight - box.top + 4}px`;
    (entries.find((entry) => !entry.disabled) ?? menu).focus();
  }

  /** @param {MenuItem} item */
  function makeEntry({ text, note, title, run, isDisabled = false }) {
    const entry = make("button", { type: "button", role: "menuitem", title, disabled: isDisabled }, text, make("small", {}, note));
    entry.addEventListener("click", () => {
      close();
      run();
    });
    return entry;
  }

  function close() {
    const hadFocus = menu.contains(document.activeElement);
    menu.hidden = true;
    button.setAttribute("aria-expanded", "false");
    if (hadFocus) button.focus();
  }

  /** @param {KeyboardEvent} event */
  function key(event) {
    const items = [...menu.querySelectorAll("button")].filter((item) => !item.disabled);
    const at = items.indexOf(/** @type {HTMLButtonElement} */ (document.activeElement));
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (event.key === "Escape") close();
    else if (step) items[(at + step + items.length) % items.length]?.focus();
    else return;
    event.preventDefault();
  }
}
