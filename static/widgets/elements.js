/** Find elements of the page, and make elements, icons, buttons and key caps. */

const SVG = "http://www.w3.org/2000/svg";

/**
 * Values that an element is made with: properties by their names, attributes by names with a dash, styles by names that begin
 * with two dashes.
 *
 * @template {keyof HTMLElementTagNameMap} Tag
 * @typedef {Partial<Omit<HTMLElementTagNameMap[Tag], "style">> & {[attribute: `${string}-${string}`]: string}} Properties
 */

/**
 * Make an element. Texts never become markup.
 *
 * @template {keyof HTMLElementTagNameMap} Tag
 * @param {Tag} tag
 * @param {Properties<Tag> | string} [properties] or only the class name
 * @param {...(string | Node)} children
 * @returns {HTMLElementTagNameMap[Tag]}
 */
export function make(tag, properties = {}, ...children) {
  const element = document.createElement(tag);
  const all = typeof properties === "string" ? { className: properties } : properties;
  for (const [name, value] of Object.entries(all)) {
    if (name.startsWith("--")) element.style.setProperty(name, String(value));
    else if (name.includes("-") || name === "role") element.setAttribute(name, String(value));
    else Reflect.set(element, name, value);
  }
  element.append(...children);
  return element;
}

/**
 * Make an element of a drawing.
 *
 * @template {keyof SVGElementTagNameMap} Tag
 * @param {Tag} tag
 * @param {Record<string, string | number>} attributes
 * @param {...(string | Node)} children
 * @returns {SVGElementTagNameMap[Tag]}
 */
export function makeSvg(tag, attributes, ...children) {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, String(value));
  element.append(...children);
  return element;
}

/** @param {string} path in a box of 16 by 16 */
export function icon(path) {
  return makeSvg("svg", { viewBox: "0 0 16 16", "aria-hidden": "true" }, makeSvg("path", { d: path }));
}

/**
 * @template {HTMLElement} T
 * @param {string} id
 * @param {{new (): T}} kind
 * @returns {T}
 */
export function byId(id, kind) {
  const element = document.getElementById(id);
  if (!(element instanceof kind)) throw new Error(`the page has no ${kind.name} with id '${id}'`);
  return element;
}

/**
 * Call a function on click. After a click by pointer the button loses focus, so that Space still plays.
 *
 * @param {HTMLButtonElement} element
 * @param {() => void} run
 */
function onPress(element, run) {
  element.addEventListener("click", (event) => {
    if (event.detail > 0) element.blur();
    run();
  });
  return element;
}

/**
 * Call a function when a field has changed, which then loses focus, so that Space still plays.
 *
 * @param {HTMLSelectElement | HTMLInputElement} field
 * @param {() => void} act
 */
export function onChange(field, act) {
  field.addEventListener("change", () => {
    act();
    field.blur();
  });
}

/**
 * Call a function when a form is submitted, instead of loading a page.
 *
 * @param {HTMLFormElement} form
 * @param {() => void} run
 */
export function onSubmit(form, run) {
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    run();
  });
}

/**
 * Find a button and call a function on click.
 *
 * @param {string} id
 * @param {() => void} run
 */
export function button(id, run) {
  return onPress(byId(id, HTMLButtonElement), run);
}

/**
 * Make a button that calls a function on click.
 *
 * @param {string} text
 * @param {string} title
 * @param {() => void} run
 * @param {Properties<"button">} [more] properties
 */
export function textButton(text, title, run, more) {
  return onPress(make("button", { type: "button", title, ...more }, text), run);
}

/**
 * Make a button with an icon instead of text.
 *
 * @param {string} path of the icon, in a box of 16 by 16
 * @param {string} title tooltip, with the key in parentheses; without the key it is the button's name
 * @param {() => void} run
 */
export function iconButton(path, title, run) {
  const label = title.replace(/ \(.*\)$/, "");
  return make("button", { type: "button", className: "is-icon", title, "aria-label": label, onclick: run }, icon(path));
}

/**
 * Make a check box, or a radio button, within its label.
 *
 * @param {string} label
 * @param {string} title
 * @param {Properties<"input">} [more] properties of the input
 */
export function checkbox(label, title, more) {
  const input = make("input", { type: "checkbox", ...more });
  return { element: make("label", { title }, input, make("span", {}, label)), input };
}

/**
 * Make a row of a table: its name, and cells with texts.
 *
 * @param {string} name
 * @param {string[]} texts
 * @param {"th" | "td"} [kind] of the cells after the name
 */
export function tableRow(name, texts, kind = "td") {
  return make("tr", {}, make("th", { scope: "row" }, name), ...texts.map((text) => make(kind, {}, text)));
}

/**
 * Make a table.
 *
 * @param {string} className
 * @param {string[][]} heads text of each column, and its title if it has one
 * @param {Node[]} rows
 */
export function makeTable(className, heads, rows) {
  const head = heads.map(([text, title]) => make("th", { scope: "col", ...(title && { title }) }, text));
  return make("table", className, make("thead", {}, make("tr", {}, ...head)), make("tbody", {}, ...rows));
}

/**
 * Show keyboard keys as key caps.
 *
 * @param {string[]} keys alternatives, each of them keys that are pressed together
 */
export function keyCaps(keys) {
  const caps = make("span", "keys");
  keys.forEach((key, index) => {
    if (index > 0) caps.append(" or ");
    for (const part of key.split(" ")) caps.append(make(part === "–" ? "span" : "kbd", {}, part), " ");
  });
  return caps;
}
