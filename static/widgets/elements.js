/** Find elements of the page, and build buttons and key caps. */

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
 * Find a button and call a function on click. After a click by pointer the button loses focus, so that Space still plays.
 *
 * @param {string} id
 * @param {() => void} run
 */
export function button(id, run) {
  const element = byId(id, HTMLButtonElement);
  element.addEventListener("click", (event) => {
    if (event.detail > 0) element.blur();
    run();
  });
  return element;
}

/**
 * Show keyboard keys as key caps.
 *
 * @param {string[]} keys alternatives, each of them keys that are pressed together
 */
export function keyCaps(keys) {
  const caps = document.createElement("span");
  caps.className = "keys";
  keys.forEach((key, index) => {
    if (index > 0) caps.append(" or ");
    for (const part of key.split(" ")) {
      const cap = document.createElement(part === "–" ? "span" : "kbd");
      cap.textContent = part;
      caps.append(cap, " ");
    }
  });
  return caps;
}

/**
 * Make a button with an icon instead of text.
 *
 * @param {string} path of the icon, in a box of 16 by 16
 * @param {string} title tooltip, with the key in parentheses; without the key it is the button's name
 * @param {() => void} run
 */
export function iconButton(path, title, run) {
  const one = document.createElement("button");
  one.type = "button";
  one.className = "is-icon";
  one.title = title;
  one.setAttribute("aria-label", title.replace(/ \(.*\)$/, ""));
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", "0 0 16 16");
  svg.setAttribute("aria-hidden", "true");
  const line = document.createElementNS("http://www.w3.org/2000/svg", "path");
  line.setAttribute("d", path);
  svg.append(line);
  one.append(svg);
  one.addEventListener("click", run);
  return one;
}
