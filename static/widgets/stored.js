/** Values that the browser keeps for the page. */

/**
 * @param {string} key
 * @returns {any} undefined where nothing is kept, or something else has written it
 */
export function stored(key) {
  try {
    return JSON.parse(localStorage.getItem(key) ?? "") ?? undefined;
  } catch {
    return undefined;
  }
}

/**
 * @param {string} key
 * @param {unknown} value
 */
export function store(key, value) {
  localStorage.setItem(key, JSON.stringify(value));
}
