/** Bindings of keys. A key is matched as it is displayed, such as "Alt Shift H". */

/**
 * @typedef {object} Command
 * @property {string[]} [keys] keys as they are displayed; none for a command of the palette alone
 * @property {string} label
 * @property {(event: KeyboardEvent) => boolean} [matches] where it is not by `keys`, which then cannot be changed
 * @property {(event: KeyboardEvent) => void} run
 * @property {string} [words] further words that the palette finds it by
 * @property {string} [area] area of the key list
 * @property {() => string | null} [why] why the command is unavailable; null if it is available
 * @property {() => void} [release] end of a command that lasts while its key is held
 * @property {boolean} [anywhere] whether it also applies while the user types text
 * @typedef {Command & {keys: string[]}} Binding
 */

/** Steps of the arrow keys, to the right and up. */
export const ARROWS = new Map([["ArrowLeft", [-1, 0]], ["ArrowRight", [1, 0]], ["ArrowUp", [0, 1]], ["ArrowDown", [0, -1]]]); // prettier-ignore
/** Characters of keys, where they are not the displayed name. @type {Record<string, string>} */
const CHARACTERS = { Space: " ", "Shift ,": "<", "Shift .": ">" };
/** Positions of keys, where they are not the displayed name. @type {Record<string, string>} */
const POSITIONS = {
  ",": "Comma", ".": "Period", ";": "Semicolon", "'": "Quote", "[": "BracketLeft", "]": "BracketRight", "`": "Backquote",
}; // prettier-ignore
const PUNCTUATION = Object.fromEntries(Object.entries(POSITIONS).map(([name, position]) => [position, name]));
const DISPLAYED = /^(Ctrl )?(Alt )?(Shift )?([^\sa-z]|F\d+|Space|Enter|Delete|Backspace|Insert|Home|End|Page(Up|Down)|Arrow(Up|Down|Left|Right))$/;

/**
 * Whether a text is a key as it is displayed.
 *
 * @param {unknown} text
 */
export function isKey(text) {
  return typeof text === "string" && DISPLAYED.test(text);
}

/**
 * Match a key by its character, with Alt by its position, since Alt changes characters; a digit with Shift likewise.
 * Punctuation, which lies elsewhere on other keyboards, is matched by either.
 *
 * @param {string} displayed
 * @param {KeyboardEvent} event
 */
function matchesKey(displayed, event) {
  const modifiers = displayed.split(" ");
  const name = modifiers.pop() ?? "";
  const [control, alt, shift] = ["Ctrl", "Alt", "Shift"].map((one) => modifiers.includes(one));
  const character = CHARACTERS[displayed] ?? CHARACTERS[name] ?? name.toLowerCase();
  const position = POSITIONS[name] ?? name.replace(/^[A-Z]$/, "Key$&").replace(/^\d$/, "Digit$&");
  const isByPosition = alt || (shift && position.startsWith("Digit"));
  return (
    (event.ctrlKey || event.metaKey) === control &&
    event.altKey === alt &&
    event.shiftKey === shift &&
    ((!isByPosition && event.key.toLowerCase() === character) || ((isByPosition || name in POSITIONS) && event.code === position))
  );
}

/**
 * Whether a command obeys the key that was pressed.
 *
 * @param {Binding} binding
 * @param {KeyboardEvent} event
 */
export function obeys({ matches, keys }, event) {
  return matches ? matches(event) : keys.some((key) => matchesKey(key, event));
}

/**
 * The pressed key as it is displayed; null if it has no name by which it could be matched.
 *
 * @param {KeyboardEvent} event
 */
export function keyOf(event) {
  const { ctrlKey, metaKey, altKey, shiftKey, key, code } = event;
  const modifiers = [(ctrlKey || metaKey) && "Ctrl", altKey && "Alt", shiftKey && "Shift"].filter(Boolean);
  const atPosition = PUNCTUATION[code] ?? code.replace(/^(Key|Digit)/, "");
  const name = key === " " ? "Space" : key.length > 1 ? key : /[a-z]/i.test(key) && !altKey ? key.toUpperCase() : altKey || shiftKey ? atPosition : key;
  const displayed = [...modifiers, name].join(" ");
  return isKey(displayed) && matchesKey(displayed, event) ? displayed : null;
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
  return commands.map((command) => ({ area, why, keys: [], ...command }));
}

/**
 * Make a command that only the palette has.
 *
 * @param {string} label
 * @param {string} words further words that it is found by
 * @param {() => void} run
 * @param {() => string | null} [why] why it is unavailable
 * @returns {Command}
 */
export function command(label, words, run, why) {
  return { label, words, run, why };
}
