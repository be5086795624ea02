/** Requests with JSON, which the program answers with lines. */

/**
 * Send JSON to the program.
 *
 * @param {string} address
 * @param {unknown} body
 * @param {(line: string) => void} [take] called with each line of the answer as it arrives
 * @param {AbortSignal} [signal] ends the request
 * @throws {Error} with the reason of the program, if it refuses; with that of the signal, if it ends the request
 */
export async function postJson(address, body, take = () => undefined, signal) {
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
