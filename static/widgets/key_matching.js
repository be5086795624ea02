/** Which key press means what: by character, or, since Shift and Alt change that by keyboard layout, by place. */

/**
 * @typedef {object} Binding
 * @property {string[]} keys how the keys are written for people
 * @property {string} label
 * @property {(event: KeyboardEvent) => boolean} matches
 * @property {(event: KeyboardEvent) => void} run
 * @property {string} [area] what it is about
 * @property {() => string | null} [why] why it is not possible now; null where it is
 * @property {boolean} [anywhere] obeyed while something is typed, too
 */

/**
 * A plain key, by its character or its place.
 *
 * @param {string} key
 * @param {string} [code]
 * @param {boolean} [shift]
 * @returns {(event: KeyboardEvent) => boolean}
 */
export function plain(key, code, shift = false) {
  return (event) =>
    !event.ctrlKey &&
    !event.metaKey &&
    !event.altKey &&
    event.shiftKey === shift &&
    (event.key.toLowerCase() === key || (code !== undefined && event.code === code));
}

/**
 * @param {string} key
 * @param {boolean} shift
 * @returns {(event: KeyboardEvent) => boolean}
 */
export function control(key, shift) {
  return (event) =>
    (event.ctrlKey || event.metaKey) && !event.altKey && event.shiftKey === shift && event.key.toLowerCase() === key;
}

/**
 * @param {string} code place of the key
 * @param {boolean} shift
 * @returns {(event: KeyboardEvent) => boolean}
 */
export function alt(code, shift) {
  return (event) => event.altKey && !event.ctrlKey && !event.metaKey && event.shiftKey === shift && event.code === code;
}

/**
 * Set the area of some bindings, and a default reason why they are unavailable.
 *
 * @param {string} area
 * @param {Binding[]} bindings
 * @param {() => string | null} [why]
 * @returns {Binding[]}
 */
export function inArea(area, bindings, why) {
  return bindings.map((binding) => ({ area, why, ...binding }));
}
