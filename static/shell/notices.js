/** Notices that disappear after a while, the message log, and the banner while disconnected. */

import { button, byId, make } from "../widgets/elements.js";
import { opensPopover, togglePopover } from "../widgets/popovers.js";

const INFO_MS = 5000;
const ERROR_MS = 20000;
const MAX_SHOWN = 3;
const MAX_LOGGED = 100;

/**
 * @typedef {import("../model/protocol.js").NoticeMessage} Notice
 * @typedef {Notice & {time: Date, count: number}} Logged
 * @typedef {{element: HTMLElement, text: string, count: number, timer: number}} Shown
 */

export class Notices {
  #place = byId("notices", HTMLElement);
  #panel = byId("notice-log", HTMLElement);
  #list = byId("notice-log-list", HTMLElement);
  #button = byId("show-notices", HTMLButtonElement);
  /** @type {Shown[]} oldest first */
  #shown = [];
  /** @type {Logged[]} newest first */
  #log = [];

  constructor() {
    opensPopover(this.#panel, this.#button, () => this.toggleLog());
    button("clear-notices", () => {
      this.#log = [];
      this.#showLog();
    });
    this.#showLog();
  }

  /** @param {Notice} notice */
  show({ type, level, text }) {
    const known = this.#shown.find((shown) => shown.text === text);
    const first = this.#log[0];
    if (first?.text === text) Object.assign(first, { count: first.count + 1, time: new Date() });
    else this.#log.unshift({ type, level, text, time: new Date(), count: 1 });
    this.#log.length = Math.min(this.#log.length, MAX_LOGGED);
    this.#showLog();
    if (known) this.#again(known, level);
    else this.#add(level, text);
  }

  toggleLog() {
    togglePopover(this.#panel, this.#button);
  }

  /** Close the newest notice. Returns whether there was one. */
  dismiss() {
    const last = this.#shown.at(-1);
    if (last) this.#remove(last);
    return last !== undefined;
  }

  dismissAll() {
    for (const shown of [...this.#shown]) this.#remove(shown);
  }

  /**
   * @param {"error" | "info"} level
   * @param {string} text
   */
  #add(level, text) {
    const element = make("div", { className: `notice is-${level}`, role: level === "error" ? "alert" : "status" });
    const close = make("button", { type: "button", "aria-label": "Dismiss", title: "Dismiss (Shift+Esc)" }, "×");
    element.append(make("span", {}, text), close);
    const shown = { element, text, count: 1, timer: 0 };
    close.addEventListener("click", () => this.#remove(shown));
    // A notice stays while the pointer or the focus is on it.
    for (const event of ["pointerenter", "focusin"]) element.addEventListener(event, () => clearTimeout(shown.timer));
    for (const event of ["pointerleave", "focusout"]) element.addEventListener(event, () => this.#wait(shown, level));
    this.#shown.push(shown);
    this.#place.append(element);
    this.#wait(shown, level);
    while (this.#shown.length > MAX_SHOWN) this.#remove(this.#shown[0]);
  }

  /**
   * Count a repeated notice instead of showing it again.
   *
   * @param {Shown} shown
   * @param {"error" | "info"} level
   */
  #again(shown, level) {
    shown.count += 1;
    shown.element.dataset.count = `× ${shown.count}`;
    this.#wait(shown, level);
  }

  /**
   * @param {Shown} shown
   * @param {"error" | "info"} level
   */
  #wait(shown, level) {
    clearTimeout(shown.timer);
    shown.timer = setTimeout(() => this.#remove(shown), level === "error" ? ERROR_MS : INFO_MS);
  }

  /** @param {Shown} shown */
  #remove(shown) {
    clearTimeout(shown.timer);
    shown.element.remove();
    this.#shown = this.#shown.filter((other) => other !== shown);
  }

  #showLog() {
    this.#list.replaceChildren(
      ...this.#log.map(({ level, text, time, count }) => {
        const item = make("li", `is-${level}`);
        const sentence = make("span", {}, count > 1 ? `${text} (${count} times)` : text);
        item.append(make("time", {}, time.toLocaleTimeString([], { hour: "2-digit", minute: "2-digit", second: "2-digit" })), sentence);
        return item;
      }),
    );
    byId("notice-log-none", HTMLElement).hidden = this.#log.length > 0;
  }
}

/**
 * @param {HTMLElement} banner
 * @param {import("../model/store.js").Store} store
 */
export function watchConnection(banner, store) {
  const show = () => {
    const { connected, session, opening, openingStep } = store.facts;
    const step = openingStep && `: ${openingStep.toLowerCase()}`;
    banner.textContent = opening !== null ? `Opening ${opening}${step}…` : session ? "Connection lost. Reconnecting…" : "Connecting…";
    banner.classList.toggle("is-shown", !connected || opening !== null);
    document.body.classList.toggle("is-cut-off", !connected);
  };
  store.on(["connected", "session", "opening", "openingStep"], () => show());
  show();
}
