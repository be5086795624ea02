/** Keys that the user has given to commands: kept by the program in a file, in place of the keys by default. */

import { isKey } from "../widgets/key_matching.js";
import { postJson } from "../widgets/post_json.js";

/**
 * @typedef {import("../widgets/key_matching.js").Binding} Binding
 * @typedef {Record<string, string[]>} Keys by the label of a command
 */

/** @typedef {ReturnType<typeof makeKeyChoices>} KeyChoices */

/**
 * @param {Binding[]} table whose keys are replaced
 * @param {(text: string) => void} tell shows what is wrong with the file
 */
export function makeKeyChoices(table, tell) {
  /** @type {Keys} */
  let given = {};
  const defaults = new Map(table.map((binding) => [binding, binding.keys]));
  /** @type {Promise<void> | null} */
  let loading = null;
  /** Called when keys have changed. @type {() => unknown} */
  let listener = () => null;

  async function read() {
    const answer = await fetch("keys");
    if (!answer.ok) return tell(await answer.text());
    const { file, keys } = await answer.json();
    const known = new Set(table.filter(({ matches }) => !matches).map(({ label }) => label));
    const taken = new Set(table.flatMap((one) => (one.matches ? one.keys : [])));
    /** @type {Keys} */
    const chosen = {};
    for (const [label, own] of Object.entries(keys)) {
      if (known.has(label) && Array.isArray(own) && own.every((key) => isKey(key) && !taken.has(key))) {
        chosen[label] = own;
        own.forEach((key) => taken.add(key));
      } else tell(`Expected a command of the list of shortcuts, and keys such as "T" or "Ctrl Shift Z" that no other line has, found "${label}" = ${JSON.stringify(own)} in ${file}; correct or remove the line.`);
    }
    apply(chosen);
  }

  /**
   * Give a key to a command, which loses its others, or none. The commands that have the key lose it.
   *
   * @param {Binding} binding
   * @param {string | null} key
   * @returns  why the choice was not kept; empty if it was
   */
  async function choose({ label }, key) {
    const others = Object.entries(given).map(([own, keys]) => [own, keys.filter((one) => one !== key)]);
    const chosen = { ...Object.fromEntries(others), [label]: key === null ? [] : [key] };
    return save(chosen, chosen);
  }

  /** Return to the keys by default. */
  async function reset() {
    const why = await save({}, Object.fromEntries(Object.keys(given).map((label) => [label, null])));
    if (why) tell(why);
  }

  /**
   * The key in place of one by default: itself where it is not changed, null where its command has none.
   *
   * @param {string} key
   */
  function replacing(key) {
    const binding = table.find((one) => defaults.get(one)?.includes(key));
    return !binding || binding.keys.includes(key) ? key : (binding.keys[0] ?? null);
  }

  /**
   * @param {Keys} chosen
   * @param {Record<string, string[] | null>} changes of lines of the file; null removes one
   */
  async function save(chosen, changes) {
    try {
      await postJson("keys", changes, () => apply(chosen));
    } catch (error) {
      return String(/** @type {Error} */ (error).message);
    }
    return "";
  }

  /** @param {Keys} chosen */
  function apply(chosen) {
    given = chosen;
    const taken = new Set(Object.values(chosen).flat());
    for (const [binding, keys] of defaults) binding.keys = chosen[binding.label] ?? (binding.matches ? keys : keys.filter((key) => !taken.has(key)));
    listener();
  }

  return {
    choose,
    reset,
    replacing,
    /** Read the file, once. */
    load: () => (loading ??= read()),
    areChanged: () => Object.keys(given).length > 0,
    /** @param {() => unknown} act called when keys have changed */
    onChange: (act) => (listener = act),
  };
}

/**
 * Let tooltips name the keys as they are chosen: titles are written with a key by default in parentheses at their end.
 *
 * @param {KeyChoices} choices
 */
export function followChoices(choices) {
  /** @type {WeakMap<Element, {written: string, shown: string}>} */
  const titles = new WeakMap();
  const show = (/** @type {{target: EventTarget | null}} */ { target }) => {
    const control = target instanceof Element ? target.closest("[title]") : null;
    if (!(control instanceof HTMLElement)) return;
    const last = titles.get(control);
    const written = last?.shown === control.title ? last.written : control.title;
    const shown = written.replace(/ \(([^()]+)\)$/, (whole, key) => {
      const now = choices.replacing(key.replaceAll("+", " "));
      return now === null ? "" : whole.replace(key, now.replaceAll(" ", "+"));
    });
    titles.set(control, { written, shown });
    if (control.title !== shown) control.title = shown;
  };
  for (const type of ["pointerover", "focusin"]) document.addEventListener(type, show, true);
  // Titles are written again while the pointer rests.
  new MutationObserver((written) => written.forEach(show)).observe(document, { subtree: true, attributeFilter: ["title"] });
}
