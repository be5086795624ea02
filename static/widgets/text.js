/** Format numbers and names for display. */

const COUNT = new Intl.NumberFormat("en", { maximumFractionDigits: 0 });

/** @param {number | null} value cost in pixels */
export function px(value) {
  return value === null ? "–" : `${value.toFixed(2)} px`;
}

/**
 * Replace underscores by spaces, as in `left elbow`.
 *
 * @param {string} name
 */
export function displayName(name) {
  return name.replaceAll("_", " ");
}

/**
 * Shorten a name in its middle, because names often differ at the end: `pers…2`.
 *
 * @param {string} name
 * @param {(text: string) => boolean} fits
 */
export function shortened(name, fits) {
  const end = name.slice(-2).trimStart();
  let text = name;
  for (let kept = name.length - end.length - 1; kept > 0 && !fits(text); kept -= 1) text = `${name.slice(0, kept).trimEnd()}…${end}`;
  return text;
}

/** @param {string} text */
export function capital(text) {
  return text.charAt(0).toUpperCase() + text.slice(1);
}

/** @param {string} text that may lack a capital and a full stop */
export function sentence(text) {
  return `${capital(text)}${text === "" || text.endsWith(".") ? "" : "."}`;
}

/** @param {number} share 0 to 1 */
export function percent(share) {
  return share > 0 && share < 0.01 ? "< 1 %" : share < 1 && share > 0.99 ? "> 99 %" : `${Math.round(100 * share)} %`;
}

/** @param {number} value */
export function count(value) {
  return COUNT.format(value);
}

/** @param {number} seconds */
export function clock(seconds) {
  const minutes = Math.floor(seconds / 60);
  return `${String(minutes).padStart(2, "0")}:${(seconds - 60 * minutes).toFixed(2).padStart(5, "0")}`;
}
