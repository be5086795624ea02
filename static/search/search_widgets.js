/** Small controls of the search tab. */

import { make } from "../widgets/elements.js";

/**
 * Make a field for an optional number. Input is sent when it is entered; values of the program are shown unless the user
 * is typing.
 *
 * @param {string} label
 * @param {string} title
 * @param {(value: number | null) => void} change
 * @param {string} [placeholder]
 */
export function makeNumber(label, title, change, placeholder = "") {
  const element = make("label", { className: "search-field", title });
  const input = make("input", { type: "number", step: "any", placeholder, "aria-label": title });
  let shown = "";
  const send = () => {
    if (input.value !== shown) change(input.value === "" ? null : Number(input.value));
    // Show the program's value, since it may have refused the input.
    input.value = shown;
  };
  input.addEventListener("change", send);
  input.addEventListener("keydown", (event) => {
    if (event.key === "Escape") input.value = shown;
    if (event.key === "Escape" || event.key === "Enter") input.blur();
    event.stopPropagation();
  });
  element.append(label, input);
  return {
    element,
    input,
    /** @param {number | null} value */
    show(value) {
      const text = value === null ? "" : String(Number(value.toPrecision(4)));
      if (text === shown) return;
      shown = text;
      if (document.activeElement !== input || input.value === "") input.value = text;
    },
  };
}
