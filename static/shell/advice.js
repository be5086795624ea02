/** The line over the views: what holds and the next step, or for a while the answer to what the user just did. */

import { button, byId, make } from "../widgets/elements.js";
import { StepsBar } from "../widgets/steps_bar.js";
import { percent } from "../widgets/text.js";
import { TimeLeft, timeText } from "../widgets/time_left.js";
import { AdviceLog } from "./advice_log.js";

/** An answer that nobody closes stays for this time, ms: a sentence is read in five seconds. */
const ANSWER_MS = { info: 5000, error: 20000 };
const TICK_MS = 1000;

/**
 * @typedef {import("../model/protocol.js").Advice} Advice
 * @typedef {import("../model/protocol.js").Action} Action
 * @typedef {import("../model/protocol.js").NoticeMessage} Notice
 * @typedef {Pick<Advice, "text" | "level" | "share" | "done" | "steps" | "step" | "is_timed" | "at_most_s"> & {actions: Action[]}} Line
 */

export class AdviceLine {
  #store;
  #perform;
  log = new AdviceLog();
  #line = byId("advice", HTMLElement);
  #text = byId("advice-text", HTMLElement);
  #bar = byId("advice-share", HTMLProgressElement);
  #figures = byId("advice-figures", HTMLOutputElement);
  #buttons = byId("advice-actions", HTMLElement);
  #close;
  #left = new TimeLeft();
  #steps = new StepsBar();
  /** @type {Notice | null} */
  #answer = null;
  #timer = 0;
  /** Texts that the user has dismissed, and that hold still. @type {Set<string>} */
  #dismissed = new Set();
  #shownActions = "";

  /**
   * @param {import("../model/store.js").Store} store
   * @param {(action: Action) => void} perform does what a button says
   */
  constructor(store, perform) {
    this.#store = store;
    this.#perform = perform;
    this.#close = button("dismiss-advice", () => void this.dismiss());
    this.#bar.after(this.#steps.element);
    store.on(["session"], () => this.#dismissed.clear());
    store.on(["advice", "connected", "session", "opening", "openingStep", "exporting"], () => this.#show());
    setInterval(() => this.#now?.level === "work" && this.#showFigures(), TICK_MS);
    this.#show();
  }

  /** @param {Notice} notice answers what the user did */
  answer(notice) {
    this.#answer = notice;
    this.log.add(notice.text, notice.level === "error");
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => this.#forgetAnswer(), ANSWER_MS[notice.level]);
    this.#show();
  }

  /** Dismiss what the line says. Returns whether it said something that can be dismissed. */
  dismiss() {
    if (this.#answer) return this.#forgetAnswer();
    const said = this.#said;
    if (!said) return false;
    this.#dismissed.add(keyOf(said));
    this.#show();
    return true;
  }

  #forgetAnswer() {
    this.#answer = null;
    this.#show();
    return true;
  }

  /** The most urgent advice that is not dismissed. */
  get #said() {
    const said = this.#store.facts.advice?.said ?? [];
    this.#dismissed = new Set(said.map(keyOf).filter((key) => this.#dismissed.has(key)));
    return said.find((advice) => !this.#dismissed.has(keyOf(advice))) ?? null;
  }

  /** @returns {Line | null} */
  get #now() {
    const { connected, session, opening, openingStep, exporting } = this.#store.facts;
    const step = openingStep && `: ${openingStep.toLowerCase()}`;
    if (opening !== null) return line(`Opening ${opening}${step}…`, "work");
    if (!connected) return line(session ? "Connection lost. Reconnecting…" : "Connecting…", session ? "fault" : "work");
    if (this.#answer) return line(this.#answer.text, this.#answer.level === "error" ? "fault" : "next");
    if (exporting === null) return this.#said;
    const stop = { deed: /** @type {const} */ ("stop"), text: "Stop", frame: null, person: null, camera: null, of: "export" };
    return { ...line("Exporting", "work"), share: exporting, done: percent(exporting), actions: [stop] };
  }

  #show() {
    const now = this.#now;
    document.body.classList.toggle("is-cut-off", !this.#store.facts.connected);
    this.#line.dataset.level = now?.level ?? "next";
    const text = now?.text ?? "";
    if (this.#text.textContent !== text) {
      this.#text.textContent = this.#text.title = text;
      if (text && this.#store.facts.connected && !this.#answer) this.log.add(text, now?.level === "fault");
    }
    const steps = now?.steps ?? [];
    this.#steps.show(steps, now?.step ?? 0, now?.share ?? 0);
    this.#bar.hidden = now?.level !== "work" || now.share === null || steps.length > 0;
    this.#bar.value = now?.share ?? 0;
    this.#left.note(text, now?.share ?? null, performance.now() / 1000);
    this.#showFigures();
    this.#showActions(now?.actions ?? []);
    this.#close.hidden = now === null || (now !== this.#said && !this.#answer);
  }

  #showFigures() {
    const now = this.#now;
    const seconds = now?.share == null || !now.is_timed ? null : this.#left.at(performance.now() / 1000);
    const bound = now?.at_most_s ?? null;
    const left = bound !== null ? `at most ${timeText(bound)}` : seconds === null ? "" : timeText(seconds);
    const isPart = left && now && now.step < now.steps.length - 1;
    const text = [now?.done, left && left + (isPart ? " in this step" : "")].filter(Boolean).join(", ");
    if (this.#figures.textContent !== text) this.#figures.textContent = text;
  }

  /** @param {Action[]} actions of which the first is the one to take */
  #showActions(actions) {
    const described = JSON.stringify(actions);
    if (described === this.#shownActions) return;
    this.#shownActions = described;
    this.#buttons.replaceChildren(
      ...actions.map((action, rank) => {
        const press = make("button", { type: "button", className: rank === 0 ? "is-primary" : "", title: action.text }, action.text);
        press.dataset.deed = action.deed;
        press.addEventListener("click", (event) => {
          if (event.detail > 0) press.blur(); // keys go to the views again
          this.#perform(action);
        });
        return press;
      }),
    );
  }
}

/**
 * @param {string} text
 * @param {Advice["level"]} level
 * @returns {Line}
 */
function line(text, level) {
  return { text, level, share: null, done: "", steps: [], step: 0, is_timed: true, at_most_s: null, actions: [] };
}

/** @param {Advice} advice */
function keyOf({ situation, text, level }) {
  return level === "work" ? situation : `${situation}: ${text}`;
}
