/** Fields that take a path: completion as one types, and a button that opens the path picker. */

import { iconButton, make } from "../widgets/elements.js";
import { completePaths } from "./session_requests.js";

const FOLDER = "M2 4.5v8h12V6H8L6.5 4.5z";

/**
 * Complete the field of a label and give it its button.
 *
 * @param {HTMLInputElement} input
 * @param {() => void} browse called by the button
 */
export function makePathField(input, browse) {
  const list = make("datalist", { id: `${input.id}-paths` });
  input.setAttribute("list", list.id);
  input.autocomplete = "off";
  input.spellcheck = false;
  completePaths(input, list);
  const label = input.closest("label") ?? input.labels?.[0]; // a form that is not in the page yet has no labels
  const title = `Browse for ${label?.textContent?.toLowerCase()}`;
  const button = iconButton(FOLDER, title, browse);
  Object.assign(button.dataset, { browse: input.name, noCommand: "" });
  input.after(list, button);
}
