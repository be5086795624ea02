/** Fields that take a path: completion as one types, and a button that opens the path picker. */

import { iconButton, make } from "../widgets/elements.js";
import { completePaths } from "./session_requests.js";

const FOLDER = "M2 4.5v8h12V6H8L6.5 4.5z";

/**
 * Complete the field of a label and give it the button of the path picker, which begins at another path of its form.
 *
 * @param {HTMLInputElement} input
 * @param {import("./path_picker.js").PathPicker} picker
 */
export function makePathField(input, picker) {
  const list = make("datalist", { id: `${input.id}-paths` });
  input.setAttribute("list", list.id);
  input.autocomplete = "off";
  input.spellcheck = false;
  completePaths(input, list);
  const label = input.closest("label") ?? input.labels?.[0]; // a form that is not in the page yet has no labels
  const title = `Browse for ${label?.textContent?.toLowerCase()}`;
  const button = iconButton(FOLDER, title, () => {
    const paths = /** @type {HTMLInputElement[]} */ ([...(input.form?.querySelectorAll(".path-field input") ?? [])]);
    const from = input.value || paths.map(({ value }) => value.trim()).find(Boolean);
    picker.show(input.dataset.takes === "files" ? "files" : "folder", from ?? "", (path) => {
      input.value = path;
      input.dispatchEvent(new Event("input", { bubbles: true }));
    });
  });
  Object.assign(button.dataset, { browse: input.name, noCommand: "" });
  input.after(list, button);
}
