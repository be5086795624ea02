/** Completion of paths. */

import { make } from "../widgets/elements.js";

/** Wait for a pause in typing before paths are completed. */
const PAUSE_MS = 120;

/**
 * Complete the path in a field as the user types.
 *
 * @param {HTMLInputElement} field
 * @param {HTMLDataListElement} list of the field
 */
export function completePaths(field, list) {
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let timer;
  field.addEventListener("input", () => {
    clearTimeout(timer);
    timer = setTimeout(async () => {
      const text = field.value;
      try {
        const found = await (await fetch(`sessions/paths?text=${encodeURIComponent(text)}`)).json();
        if (field.value !== text) return;
        const option = (/** @type {{path: string, is_session: boolean}} */ { path, is_session }) =>
          make("option", { value: path, label: is_session ? "session" : "" });
        list.replaceChildren(...found.map(option));
      } catch {
        // Completion is a convenience; opening says what is wrong.
      }
    }, PAUSE_MS);
  });
}
