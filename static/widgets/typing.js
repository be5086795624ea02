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
 * Give the keys back to the page: a field loses the focus after Enter, unless its text was refused or it is in a dialog or form.
 *
 * @param {Document} target
 */
export function leaveFields(target) {
  target.addEventListener("keydown", ({ key, target: field }) => {
    if (key !== "Enter" || !(field instanceof HTMLInputElement)) return;
    if (!field.ariaInvalid && !field.closest("dialog, [role=dialog], form")) field.blur();
  });
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
