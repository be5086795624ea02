/** Fields: undo and redo belong to those with unapplied text, and keys to the page once a field is done. */

/** @type {WeakSet<Element>} fields with unapplied text */
const unfinished = new WeakSet();

/**
 * Watch the fields of a document.
 *
 * @param {Document} target
 */
export function watchTyping(target) {
  const note = (/** @type {Event} */ { type, target: field }) => {
    // Not `instanceof`: elements of the 3-D view belong to another window.
    if (!field || !("tagName" in field)) return;
    if (type === "input") unfinished.add(/** @type {Element} */ (field));
    else unfinished.delete(/** @type {Element} */ (field));
  };
  for (const type of ["input", "change", "focusin"]) target.addEventListener(type, note, true);
}

/**
 * Give the keys back to the page: a field loses the focus after Enter, a list after a choice by the pointer. Fields with
 * refused text and those of dialogs keep it.
 *
 * @param {Document} target
 */
export function leaveFields(target) {
  /** @type {EventTarget | null} the list that the pointer has opened */
  let opened = null;
  target.addEventListener("pointerdown", (event) => (opened = event.target), true);
  target.addEventListener("keydown", (event) => {
    opened = null;
    if (event.key === "Enter") leave(event.target, "input:not([aria-invalid])");
  });
  target.addEventListener("change", (event) => event.target === opened && leave(event.target, "select"));
}

/**
 * @param {EventTarget | null} field
 * @param {string} selector of the fields that are left
 */
function leave(field, selector) {
  if (field instanceof HTMLElement && field.matches(selector) && !field.closest("dialog, [role=dialog]")) field.blur();
}

/**
 * Whether a key means undo or redo of unapplied text.
 *
 * @param {Element | null} field
 * @param {KeyboardEvent} event
 */
export function keepsUndo(field, event) {
  return ["z", "y"].includes(event.key.toLowerCase()) && field !== null && unfinished.has(field);
}
