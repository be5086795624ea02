/** Small pieces that the parts of the section share. */

import { make, onSubmit } from "../widgets/elements.js";

/**
 * Line that opens a form below it, with its content.
 *
 * @param {string} title
 * @param {string} hint
 * @param {HTMLElement[]} content
 */
export function fold(title, hint, ...content) {
  return make("details", "plan-fold", make("summary", { title: hint }, title), ...content);
}

/**
 * Field for a line of text that Enter sends and Esc empties. It offers texts that were sent before.
 *
 * @param {string} name for screen readers
 * @param {string} action label of the button
 * @param {(text: string) => void} send
 */
export function lineForm(name, action, send) {
  const input = make("input", { className: "query-field", type: "text", placeholder: name, autocomplete: "off", maxLength: 2000, "aria-label": name });
  const button = make("button", { type: "submit", title: `${action}: ${name}` }, action);
  const offered = make("datalist", { id: `offered-${action.toLowerCase()}` });
  input.setAttribute("list", offered.id);
  const form = make("form", "plan-line", input, button, offered);
  const enable = () => (button.disabled = !input.value.trim());
  enable();
  input.addEventListener("input", enable);
  onSubmit(form, () => {
    const text = input.value.trim();
    if (!text) return;
    input.value = "";
    enable();
    input.blur();
    send(text);
  });
  return {
    form,
    input,
    clear() {
      input.value = "";
      enable();
    },
    /** @param {string[]} texts earliest first; of equal ones the last one counts */
    offer(texts) {
      const latest = [...new Set(texts.filter(Boolean).reverse())];
      offered.replaceChildren(...latest.map((text) => new Option(text)));
    },
  };
}
