/** Small controls that the search tab makes many of. */

/**
 * A button that gives the focus back after a click by pointer, so that keys go on to mean what they mean.
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
 * A field for a number that may be empty. What is typed counts when it is entered; what the program says is shown unless
 * the field is being typed in.
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
    // The program's answer is what counts: it may have refused.
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
