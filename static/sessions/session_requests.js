/** Requests about sessions: complete a path, and send JSON whose answer is read line by line. */

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

/**
 * Send JSON to the program.
 *
 * @param {string} address
 * @param {unknown} body
 * @param {(line: string) => void} take called with each line of the answer as it arrives
 * @param {AbortSignal} [signal] ends the request
 * @throws {Error} with the reason of the program, if it refuses; with that of the signal, if it ends the request
 */
export async function postJson(address, body, take, signal) {
  const headers = { "Content-Type": "application/json" };
  let answer;
  try {
    answer = await fetch(address, { method: "POST", headers, body: JSON.stringify(body), signal });
  } catch {
    signal?.throwIfAborted();
    throw new Error("The program does not answer.");
  }
  if (!answer.ok || !answer.body) throw new Error(await answer.text());
  const decoder = new TextDecoder();
  const reader = answer.body.getReader();
  let rest = "";
  for (let part = await reader.read(); !part.done; part = await reader.read()) {
    const lines = (rest + decoder.decode(part.value, { stream: true })).split("\n");
    rest = lines.pop() ?? "";
    lines.forEach(take);
  }
  if (rest) take(rest);
}
