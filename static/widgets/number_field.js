/** Text field for one number: Enter applies and leaves it, Esc restores, arrows step, and invalid input is refused with a message. */

import { make } from "./elements.js";

/**
 * @typedef {object} NumberField
 * @property {HTMLInputElement} element
 * @property {(text: string) => void} show set the text to display while the user is not typing
 */

/** Multiple of a step that a key with Shift or Ctrl takes. @param {KeyboardEvent} event */
export function factorOf(event) {
  return event.shiftKey ? 10 : event.ctrlKey ? 0.1 : 1;
}

/**
 * @param {object} options
 * @param {string} options.name for screen readers
 * @param {(text: string) => string | null} options.take apply the text; returns a message if it is invalid
 * @param {(why: string) => void} options.refuse show that message
 * @param {((factor: number) => void) | null} options.step handle the up and down arrows; null for no steps
 * @returns {NumberField}
 */
export function numberField({ name, take, refuse, step }) {
  const element = make("input", { type: "text", inputMode: "decimal", autocomplete: "off", spellcheck: false, className: "number-field", "aria-label": name });
  let shown = "";

  const restore = () => {
    element.value = shown;
    mark(false);
  };
  const mark = (/** @type {boolean} */ isWrong) => {
    element.classList.toggle("is-refused", isWrong);
    if (isWrong) element.setAttribute("aria-invalid", "true");
    else element.removeAttribute("aria-invalid");
  };
  const apply = () => {
    if (element.value === shown) return true;
    const why = take(element.value.trim().replace(",", "."));
    mark(why !== null);
    if (why !== null) refuse(why);
    else shown = element.value;
    return why === null;
  };

  element.addEventListener("focus", () => element.select());
  element.addEventListener("input", () => mark(false));
  element.addEventListener("blur", () => {
    if (!apply()) restore();
  });
  element.addEventListener("keydown", (event) => {
    if (event.key === "Enter") {
      event.preventDefault();
      apply();
    } else if (event.key === "Escape") {
      // Esc must not also stop a running search.
      event.preventDefault();
      restore();
      element.blur();
    } else if (step && (event.key === "ArrowUp" || event.key === "ArrowDown")) {
      event.preventDefault();
      if (apply()) step((event.key === "ArrowUp" ? 1 : -1) * factorOf(event));
    }
  });
  return {
    element,
    show(text) {
      const isTyping = document.activeElement === element && element.value !== shown;
      shown = text;
      if (!isTyping && element.value !== text) {
        element.value = text;
        mark(false);
        if (document.activeElement === element) element.select();
      }
    },
  };
}
