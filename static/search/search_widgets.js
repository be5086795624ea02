/** Small controls of the search tab. */

/**
 * Make a button that loses focus after a click by pointer, so that keys keep their meaning.
 *
 * @param {string} text
 * @param {string} title
 * @param {() => void} run
 */
export function makeButton(text, title, run) {
  const element = document.createElement("button");
  element.type = "button";
  element.textContent = text;
  element.title = title;
  element.addEventListener("click", (event) => {
    if (event.detail > 0) element.blur();
    run();
  });
  return element;
}

/**
 * Make a field for an optional number. Input is sent when it is entered; values of the program are shown unless the user
 * is typing.
 *
 * @param {{label: string, title: string, placeholder?: string, change: (value: number | null) => void}} options
 */
export function makeNumber({ label, title, placeholder = "", change }) {
  const element = document.createElement("label");
  element.className = "search-field";
  element.title = title;
  const input = document.createElement("input");
  input.type = "number";
  input.step = "any";
  input.placeholder = placeholder;
  input.setAttribute("aria-label", title);
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
