/** The sentences that the line over the views has said, newest first. */

import { button, byId, make } from "../widgets/elements.js";
import { opensPopover, togglePopover } from "../widgets/popovers.js";

const MAX_LOGGED = 100;

export class AdviceLog {
  #panel = byId("advice-log", HTMLElement);
  #list = byId("advice-log-list", HTMLElement);
  #button = byId("show-advice-log", HTMLButtonElement);
  /** @type {{text: string, isFault: boolean, time: Date, count: number}[]} newest first */
  #said = [];

  constructor() {
    opensPopover(this.#panel, this.#button, () => this.toggle());
    button("clear-advice-log", () => {
      this.#said = [];
      this.#show();
    });
    this.#show();
  }

  /**
   * @param {string} text
   * @param {boolean} isFault
   */
  add(text, isFault) {
    const first = this.#said[0];
    if (first?.text === text) Object.assign(first, { count: first.count + 1, time: new Date() });
    else this.#said.unshift({ text, isFault, time: new Date(), count: 1 });
    this.#said.length = Math.min(this.#said.length, MAX_LOGGED);
    this.#show();
  }

  toggle() {
    togglePopover(this.#panel, this.#button);
  }

  #show() {
    this.#list.replaceChildren(
      ...this.#said.map(({ text, isFault, time, count }) => {
        const sentence = make("span", {}, count > 1 ? `${text} (${count} times)` : text);
        const clock = time.toLocaleTimeString([], { hour: "2-digit", minute: "2-digit", second: "2-digit" });
        return make("li", isFault ? "is-error" : "", make("time", {}, clock), sentence);
      }),
    );
    byId("advice-log-none", HTMLElement).hidden = this.#said.length > 0;
  }
}
