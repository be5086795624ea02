/** Match key presses by character, or by key position, since Shift and Alt change characters depending on the keyboard layout. */

/**
 * @typedef {object} Binding
 * @property {string[]} keys keys as they are displayed
 * @property {string} label
 * @property {(event: KeyboardEvent) => boolean} matches
 * @property {(event: KeyboardEvent) => void} run
 * @property {string} [words] further words that the palette finds it by
 * @property {string} [area] area of the key list
 * @property {() => string | null} [why] why the command is unavailable; null if it is available
 * @property {() => void} [release] end of a command that lasts while its key is held
 * @property {boolean} [anywhere] whether it also applies while the user types text
 */

/**
 * Match a plain key by its character or its position.
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
 * @param {string} code position of the key
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
