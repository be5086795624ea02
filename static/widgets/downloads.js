/** Files of the program that the browser saves. */

import { make } from "./elements.js";

/** Longest text of the server that is shown as its reason. */
const MAX_REASON = 400;

/**
 * Save a file of the program; returns its name.
 *
 * @param {string} address
 * @param {AbortSignal} [signal] stops it
 * @throws {Error} with the reason of the program, if it refuses
 */
export async function download(address, signal) {
  const answer = await fetch(address, { signal });
  if (!answer.ok) throw new Error((await answer.text()).slice(0, MAX_REASON));
  const name = fileName(answer.headers.get("Content-Disposition") ?? "");
  save(await answer.blob(), name);
  return name;
}

/** @param {string} disposition header with the name of a file */
function fileName(disposition) {
  const name = /filename\*=UTF-8''([^;]+)/.exec(disposition)?.[1];
  return name ? decodeURIComponent(name) : "export";
}

/**
 * Save data as a file of the browser.
 *
 * @param {Blob} data
 * @param {string} name
 */
function save(data, name) {
  const link = make("a", { href: URL.createObjectURL(data), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}
