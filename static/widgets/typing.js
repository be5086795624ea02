/** Track fields with unapplied text. In those, undo and redo belong to the field. */

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
 * Whether a key means undo or redo of unapplied text.
 *
 * @param {Element | null} field
 * @param {KeyboardEvent} event
 */
export function keepsUndo(field, event) {
  return ["z", "y"].includes(event.key.toLowerCase()) && field !== null && unfinished.has(field);
}
