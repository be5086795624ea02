/** Buttons that go to doubtful frames, and a menu of other kinds of frames to go to. */

import { button, byId, iconButton, make } from "../widgets/elements.js";
import { KINDS } from "./jumps.js";
import { count } from "../widgets/text.js";

const PREVIOUS = "M10 3.5 5 8l5 4.5";
const NEXT = "m6 3.5 5 4.5-5 4.5";

export class JumpMenu {
  #store;
  #jumps;
  #previous;
  #next;
  #open;
  #menu = byId("jump-menu", HTMLElement);
  /** @type {Map<import("./jumps.js").Kind, {count: HTMLElement, buttons: HTMLButtonElement[]}>} */
  #rows = new Map();
  #gap = make("button");
  #list = make("button", {}, "List doubts by severity");

  /**
   * @param {import("../model/store.js").Store} store
   * @param {import("./jumps.js").Jumps} jumps
   * @param {() => void} listDoubts opens the list of doubts
   */
  constructor(store, jumps, listDoubts) {
    this.#store = store;
    this.#jumps = jumps;
    this.#previous = button("previous-doubt", () => jumps.go("doubt", -1));
    this.#next = button("next-doubt", () => jumps.go("doubt", 1));
    this.#open = button("show-jumps", () => this.#show(this.#menu.hidden));
    this.#build();
    this.#list.addEventListener("click", () => {
      this.#show(false);
      listDoubts();
    });
    document.addEventListener("pointerdown", (event) => {
      const at = /** @type {Node} */ (event.target);
      if (!this.#menu.contains(at) && !this.#open.contains(at)) this.#show(false);
    });
    // A click into the 3-D view is noticed only as a loss of focus.
    addEventListener("blur", () => this.#show(false));
    // Opened by the mouse, the menu has no focus. Esc closes it all the same, and does nothing else.
    const closes = (/** @type {KeyboardEvent} */ event) => {
      if (event.key !== "Escape" || this.#menu.hidden) return;
      event.preventDefault();
      event.stopPropagation();
      const hadFocus = this.#menu.contains(document.activeElement);
      this.#show(false);
      if (hadFocus) this.#open.focus();
    };
    document.addEventListener("keydown", closes, true);
    store.on(["timeline", "disagreeing", "calibration", "otherCopy", "provenanceFilter", "annotators", "connected", "session"], () => this.#count());
  }

  #build() {
    const rows = KINDS.map(({ kind, label, title, key, more }) => {
      const row = make("div", { className: "jump-row", title });
      const name = make("span", {}, label);
      const number = make("output", { "aria-label": `Number of frames: ${label}` });
      const keyOf = (/** @type {boolean} */ back) => (key ? ` (${back ? previousKey(key) : key.replace(" ", "+")})` : "");
      const buttons = [
        iconButton(PREVIOUS, `Previous ${more}${keyOf(true)}`, () => this.#jumps.go(kind, -1)),
        iconButton(NEXT, `Next ${more}${keyOf(false)}`, () => this.#jumps.go(kind, 1)),
      ];
      row.append(name, number, make("kbd", {}, key.replace(" ", "+")), make("div", "group", ...buttons));
      this.#rows.set(kind, { count: number, buttons });
      return row;
    });
    this.#gap.type = "button";
    this.#gap.className = "jump-gap";
    this.#gap.textContent = "Longest gap between keyframes";
    this.#gap.title = "Go to the middle of the longest gap between keyframes, the best place for a new one (Q)";
    this.#gap.addEventListener("click", () => this.#jumps.toLongestGap());
    this.#list.type = "button";
    this.#list.className = "jump-list";
    this.#list.title = "List doubtful and lost poses with thumbnails, most severe first (Shift+L)";
    this.#menu.append(...rows, this.#gap, this.#list);
  }

  /** @param {boolean} isShown */
  #show(isShown) {
    this.#menu.hidden = !isShown;
    this.#open.setAttribute("aria-expanded", String(isShown));
    if (isShown) this.#count();
  }

  #count() {
    const { connected, session } = this.#store.facts;
    const doubts = this.#jumps.count("doubt");
    this.#previous.disabled = this.#next.disabled = !connected || doubts === 0;
    this.#open.disabled = !connected || !session;
    if (this.#menu.hidden) return;
    for (const [kind, { count: number, buttons }] of this.#rows) {
      const found = this.#jumps.count(kind);
      number.textContent = count(found);
      for (const one of buttons) one.disabled = found === 0;
    }
    const gap = this.#jumps.longestGap;
    this.#gap.disabled = !gap;
    this.#gap.textContent = gap
      ? `Longest gap between keyframes: ${count(gap.last - gap.first + 1)}`
      : "Every frame is a keyframe";
  }
}

/** @param {string} key */
function previousKey(key) {
  return key.startsWith("Alt ") ? `Alt+Shift+${key.slice(4)}` : `Shift+${key}`;
}
