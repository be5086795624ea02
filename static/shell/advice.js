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

/** @typedef {ReturnType<typeof mountAdvice>} AdviceLine */

/**
 * @param {import("../model/store.js").Store} store
 * @param {(action: Action) => void} perform does what a button says
 */
export function mountAdvice(store, perform) {
  const log = new AdviceLog();
  const shownLine = byId("advice", HTMLElement);
  const sentence = byId("advice-text", HTMLElement);
  const bar = byId("advice-share", HTMLProgressElement);
  const figures = byId("advice-figures", HTMLOutputElement);
  const buttons = byId("advice-actions", HTMLElement);
  const timeLeft = new TimeLeft();
  const stepsBar = new StepsBar();
  /** @type {Notice | null} */
  let answerText = null;
  let timer = 0;
  /** Texts that the user has dismissed, and that hold still. @type {Set<string>} */
  let dismissed = new Set();
  let shownActions = "";
  const close = button("dismiss-advice", () => void dismiss());
  bar.after(stepsBar.element);
  store.on(["session"], () => dismissed.clear());
  store.on(["advice", "connected", "session", "opening", "openingStep", "exporting"], () => show());
  setInterval(() => getNow()?.level === "work" && showFigures(), TICK_MS);
  show();

  /** @param {Notice} notice answers what the user did */
  function answer(notice) {
    answerText = notice;
    log.add(notice.text, notice.level === "error");
    clearTimeout(timer);
    timer = setTimeout(() => forgetAnswer(), ANSWER_MS[notice.level]);
    show();
  }

  /** Dismiss what the line says. Returns whether it said something that can be dismissed. */
  function dismiss() {
    if (answerText) return forgetAnswer();
    const said = getSaid();
    if (!said) return false;
    dismissed.add(keyOf(said));
    show();
    return true;
  }

  function forgetAnswer() {
    answerText = null;
    show();
    return true;
  }

  /** The most urgent advice that is not dismissed. */
  function getSaid() {
    const said = store.facts.advice?.said ?? [];
    dismissed = new Set(said.map(keyOf).filter((key) => dismissed.has(key)));
    return said.find((advice) => !dismissed.has(keyOf(advice))) ?? null;
  }

  /** @returns {Line | null} */
  function getNow() {
    const { connected, session, opening, openingStep, exporting } = store.facts;
    const step = openingStep && `: ${openingStep.toLowerCase()}`;
    if (opening !== null) return line(`Opening ${opening}${step}…`, "work");
    if (!connected) return line(session ? "Connection lost. Reconnecting…" : "Connecting…", session ? "fault" : "work");
    if (answerText) return line(answerText.text, answerText.level === "error" ? "fault" : "next");
    if (exporting === null) return getSaid();
    const stop = { deed: /** @type {const} */ ("stop"), text: "Stop", frame: null, person: null, camera: null, of: "export" };
    return { ...line("Exporting", "work"), share: exporting, done: percent(exporting), actions: [stop] };
  }

  function show() {
    const now = getNow();
    document.body.classList.toggle("is-cut-off", !store.facts.connected);
    shownLine.dataset.level = now?.level ?? "next";
    const text = now?.text ?? "";
    if (sentence.textContent !== text) {
      sentence.textContent = sentence.title = text;
      if (text && store.facts.connected && !answerText) log.add(text, now?.level === "fault");
    }
    const steps = now?.steps ?? [];
    stepsBar.show(steps, now?.step ?? 0, now?.share ?? 0);
    bar.hidden = now?.level !== "work" || now.share === null || steps.length > 0;
    bar.value = now?.share ?? 0;
    timeLeft.note(text, now?.share ?? null, performance.now() / 1000);
    showFigures();
    showActions(now?.actions ?? []);
    close.hidden = now === null || (now !== getSaid() && !answerText);
  }

  function showFigures() {
    const now = getNow();
    const seconds = now?.share == null || !now.is_timed ? null : timeLeft.at(performance.now() / 1000);
    const bound = now?.at_most_s ?? null;
    const left = bound !== null ? `at most ${timeText(bound)}` : seconds === null ? "" : timeText(seconds);
    const isPart = left && now && now.step < now.steps.length - 1;
    const text = [now?.done, left && left + (isPart ? " in this step" : "")].filter(Boolean).join(", ");
    if (figures.textContent !== text) figures.textContent = text;
  }

  /** @param {Action[]} actions of which the first is the one to take */
  function showActions(actions) {
    const described = JSON.stringify(actions);
    if (described === shownActions) return;
    shownActions = described;
    buttons.replaceChildren(
      ...actions.map((action, rank) => {
        const press = make("button", { type: "button", className: rank === 0 ? "is-primary" : "", title: action.text }, action.text);
        press.dataset.deed = action.deed;
        press.addEventListener("click", (event) => {
          if (event.detail > 0) press.blur(); // keys go to the views again
          perform(action);
        });
        return press;
      }),
    );
  }

  return { log, answer, dismiss };
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
