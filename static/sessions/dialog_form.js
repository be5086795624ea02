/** Dialog with a form whose outcome the program answers line by line. */

import { byId, make } from "../widgets/elements.js";
import { makePathField } from "./path_field.js";
import { postJson } from "../widgets/post_json.js";

export class DialogForm {
  /** Values that the form proposed, by the name of the field. @type {Record<string, string>} */
  proposed = {};

  /**
   * @param {string} id of the dialog
   * @param {import("./path_picker.js").PathPicker} picker
   */
  constructor(id, picker) {
    this.dialog = byId(id, HTMLDialogElement);
    this.form = byId(`${id}-form`, HTMLFormElement);
    this.checks = byId(`${id}-checks`, HTMLElement);
    for (const input of /** @type {NodeListOf<HTMLInputElement>} */ (this.form.querySelectorAll(".path-field input"))) {
      makePathField(input, picker);
    }
  }

  /** @param {string} name */
  field(name) {
    return /** @type {HTMLInputElement} */ (this.form.elements.namedItem(name));
  }

  /** @param {string} name */
  value(name) {
    return this.field(name).value.trim();
  }

  /**
   * The number in a field; null if it is empty.
   *
   * @param {string} name
   */
  number(name) {
    return this.value(name) ? Number(this.value(name)) : null;
  }

  /**
   * The parts of a field that are separated by commas.
   *
   * @param {string} name
   */
  list(name) {
    return this.value(name).split(",").map((part) => part.trim()).filter(Boolean); // prettier-ignore
  }

  /**
   * Fill in a field unless the user has.
   *
   * @param {string} name
   * @param {string} value
   */
  propose(name, value) {
    const field = this.field(name);
    if (field.value && field.value !== this.proposed[name]) return;
    field.value = this.proposed[name] = value;
  }

  /**
   * List a check or a doubt.
   *
   * @param {string} kind
   * @param {string} text
   */
  add(kind, text) {
    const item = make("li", kind, make("span", {}, text));
    this.checks.append(item);
    item.scrollIntoView({ block: "nearest" });
    return item;
  }

  /**
   * Send the form, and list why it failed.
   *
   * @param {string} address
   * @param {unknown} body
   * @param {(line: any) => void} take called with each object of the answer as it arrives
   * @param {AbortSignal} [signal] ends it
   */
  async post(address, body, take, signal) {
    try {
      await postJson(address, body, (line) => take(JSON.parse(line)), signal);
    } catch (error) {
      this.add("is-failed", error instanceof Error ? error.message : String(error));
    }
  }
}
