/** Elements of the page that must be there. */

/**
 * @template {HTMLElement} T
 * @param {string} id
 * @param {{new (): T}} kind
 * @returns {T}
 */
export function byId(id, kind) {
  const element = document.getElementById(id);
  if (!(element instanceof kind)) throw new Error(`index.html has no ${kind.name} with id '${id}'`);
  return element;
}

/**
 * A button that does what it says and gives the focus back after a click by pointer, so that Space goes on to mean "play".
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
 * Keys as they are printed on a keyboard.
 *
 * @param {string[]} keys alternatives, each of keys pressed together
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
 * A small button with a sign in place of words.
 *
 * @param {string} path of the sign, in a box of 16 by 16
 * @param {string} title what it does, and its key in parentheses; its name without the key
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
