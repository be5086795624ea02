/** Bindings of keys. A key is matched as it is displayed, such as "Alt Shift H". */

/**
 * @typedef {object} Command
 * @property {string[]} keys keys as they are displayed; none for a command of the palette alone
 * @property {string} label
 * @property {(event: KeyboardEvent) => boolean} [matches] where it is not by `keys`
 * @property {(event: KeyboardEvent) => void} run
 * @property {string} [words] further words that the palette finds it by
 * @property {string} [area] area of the key list
 * @property {() => string | null} [why] why the command is unavailable; null if it is available
 * @property {() => void} [release] end of a command that lasts while its key is held
 * @property {boolean} [anywhere] whether it also applies while the user types text
 * @typedef {Command & {matches: (event: KeyboardEvent) => boolean}} Binding
 */

const DIGITS = "1 – 9";
/** Characters of keys, where they are not the displayed name. @type {Record<string, string>} */
const CHARACTERS = { Space: " ", Esc: "escape", "Shift ,": "<", "Shift .": ">" };
/** Positions of keys, where they are not the displayed name. @type {Record<string, string>} */
const POSITIONS = {
  ",": "Comma", ".": "Period", ";": "Semicolon", "'": "Quote", "[": "BracketLeft", "]": "BracketRight", "`": "Backquote",
  "↑": "ArrowUp", "↓": "ArrowDown",
}; // prettier-ignore

/**
 * Match a key by its character, with Alt by its position, since Alt changes characters; a digit with Shift likewise.
 * Punctuation, which lies elsewhere on other keyboards, is matched by either.
 *
 * @param {string} displayed
 * @returns {(event: KeyboardEvent) => boolean}
 */
export function matchesKey(displayed) {
  if (displayed.includes(DIGITS)) {
    const digits = [..."123456789"].map((digit) => matchesKey(displayed.replace(DIGITS, digit)));
    return (event) => digits.some((matches) => matches(event));
  }
  const modifiers = displayed.split(" ");
  const name = modifiers.pop() ?? "";
  const [control, alt, shift] = ["Ctrl", "Alt", "Shift"].map((one) => modifiers.includes(one));
  const character = CHARACTERS[displayed] ?? CHARACTERS[name] ?? name.toLowerCase();
  const position = POSITIONS[name] ?? name.replace(/^[A-Z]$/, "Key$&").replace(/^\d$/, "Digit$&");
  const isByPosition = alt || (shift && position.startsWith("Digit"));
  return (event) =>
    (event.ctrlKey || event.metaKey) === control &&
    event.altKey === alt &&
    event.shiftKey === shift &&
    ((!isByPosition && event.key.toLowerCase() === character) || ((isByPosition || name in POSITIONS) && event.code === position));
}

/**
 * Bind commands of an area to their keys.
 *
 * @param {string} area
 * @param {Command[]} commands
 * @param {() => string | null} [why] default reason why they are unavailable
 * @returns {Binding[]}
 */
export function inArea(area, commands, why) {
  return commands.map((command) => {
    const keys = command.keys.map(matchesKey);
    return { area, why, matches: (event) => keys.some((matches) => matches(event)), ...command };
  });
}
