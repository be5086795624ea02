/** Whether text is being written in a field: what was typed there and not yet taken over is undone first, and by the field. */

/** @type {WeakSet<Element>} fields with text that was typed and not yet taken over */
const unfinished = new WeakSet();

/**
 * Watch the fields of a document.
 *
 * @param {Document} target
 */
export function watchTyping(target) {
  const note = (/** @type {Event} */ { type, target: field }) => {
    // Not `instanceof`: the 3-D view's elements are of another window.
    if (!field || !("tagName" in field)) return;
    if (type === "input") unfinished.add(/** @type {Element} */ (field));
    else unfinished.delete(/** @type {Element} */ (field));
  };
  for (const type of ["input", "change", "focusin"]) target.addEventListener(type, note, true);
}

/**
 * Whether a key means undo or redo of what is being typed.
 *
 * @param {Element | null} field
 * @param {KeyboardEvent} event
 */
export function keepsUndo(field, event) {
  return ["z", "y"].includes(event.key.toLowerCase()) && field !== null && unfinished.has(field);
}
