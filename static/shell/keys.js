/** Table of all keys, and the listener that runs them. */

import { obeys } from "../widgets/key_matching.js";
import { keepsUndo } from "../widgets/typing.js";

/** @typedef {import("../widgets/key_matching.js").Binding} Binding */

/** Areas of the table, in the order in which they are listed and matched. */
const AREAS = [
  "Frames",
  "History and help",
  "Search",
  "Tracking",
  "Timeline",
  "3-D view", // before posing: while the floor is being set, Enter belongs to it
  "Posing",
  "People",
  "Pins",
  "Annotation",
  "Views",
  "Inspector",
];

/** Keys of viser's camera while the 3-D view has the focus. */
const VISER_KEYS = new Set(["s", "w", "a", "d", "q", "e", "arrowleft", "arrowright", "arrowup", "arrowdown"]);

/** Keys that move a focused slider. */
const SLIDER_KEYS = new Set([
  "ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown", "Home", "End", "PageUp", "PageDown",
]); // prettier-ignore

/**
 * Merge the bindings of the rooms into one table.
 *
 * @param {Binding[][]} rooms
 */
export function orderedByArea(rooms) {
  return AREAS.flatMap((name) => rooms.flatMap((bindings) => bindings.filter(({ area }) => area === name)));
}

/**
 * Run bindings for the keys pressed in a document.
 *
 * @param {Document} target the page or the 3-D view
 * @param {import("../widgets/key_matching.js").Binding[]} table
 * @param {{viser: boolean, isDragging: () => boolean, say: (why: string) => void}} options `say` shows why a
 *   command is unavailable
 */
export function listen(target, table, { viser, isDragging, say }) {
  /** @type {{binding: Binding, code: string} | null} the command whose key is held */
  let held = null;
  const release = () => {
    held?.binding.release?.();
    held = null;
  };
  target.addEventListener("keyup", (event) => event.code === held?.code && release());
  target.defaultView?.addEventListener("blur", release);
  target.addEventListener("keydown", (event) => {
    const from = /** @type {HTMLElement | null} */ (event.target);
    const isEscape = event.key === "Escape";
    if (event.defaultPrevented || document.querySelector("dialog[open]")) return;
    if (!isEscape && (isDragging() || operates(from, event))) return;
    if (viser && !event.ctrlKey && VISER_KEYS.has(event.key.toLowerCase())) return;
    const binding = table.find((one) => obeys(one, event));
    if (!binding || (writes(from) && !isEscape && !(binding.anywhere && !keepsUndo(from, event)))) return;
    event.preventDefault();
    if (binding.release) held = { binding, code: event.code };
    obey(binding, event, say);
  });
}

/**
 * Run a command, and show why it is unavailable where it is.
 *
 * @param {Binding} binding
 * @param {KeyboardEvent} event
 * @param {(why: string) => void} say
 */
export function obey(binding, event, say) {
  const why = binding.why?.();
  if (why) say(why);
  binding.run(event);
}

/** @param {HTMLElement | null} element */
function writes(element) {
  // A field of a closed dialog keeps the focus until the page is drawn again.
  if (element?.closest?.("dialog:not([open])")) return false;
  return !!element?.matches?.("input:not([type=radio], [type=checkbox], [type=range]), textarea, select, [contenteditable=true]");
}

/**
 * Whether the focused control handles the key.
 *
 * @param {HTMLElement | null} element
 * @param {KeyboardEvent} event
 */
function operates(element, event) {
  if (element?.matches?.("input[type=range]") && SLIDER_KEYS.has(event.key)) return true;
  if (event.key.startsWith("Arrow")) {
    return !!element?.matches?.("[type=radio], [role=slider], [role=separator], [role=menuitem], [role=tab]");
  }
  return [" ", "Enter"].includes(event.key) && !!element?.matches?.("button, input, a, summary, [role=button]");
}
