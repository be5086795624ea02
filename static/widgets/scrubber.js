/** Turn a label into a slider: dragging it sideways changes a number. Each drag is one entry of the history. */

const FINE = 0.1;

/**
 * @param {HTMLElement} element the label
 * @param {object} options
 * @param {() => number | null} options.begin returns the number at the start of a drag; null if it cannot be changed
 * @param {number} options.perPixel change per CSS pixel; a tenth of it with Shift
 * @param {(value: number) => void} options.change called at most once per animation frame
 */
export function makeScrubber(element, { begin, perPixel, change }) {
  /** @type {{pointer: number, x: number, value: number} | null} */
  let held = null;
  let isScheduled = false;
  element.classList.add("is-scrubber");

  element.addEventListener("pointerdown", (event) => {
    const value = event.button === 0 ? begin() : null;
    if (value === null) return;
    event.preventDefault();
    element.setPointerCapture(event.pointerId);
    held = { pointer: event.pointerId, x: event.clientX, value };
  });
  element.addEventListener("pointermove", (event) => {
    if (held?.pointer !== event.pointerId || event.clientX === held.x) return;
    held.value += (event.clientX - held.x) * perPixel * (event.shiftKey ? FINE : 1);
    held.x = event.clientX;
    if (isScheduled) return;
    isScheduled = true;
    requestAnimationFrame(() => {
      isScheduled = false;
      if (held) change(held.value);
    });
  });
  const release = (/** @type {PointerEvent} */ event) => {
    if (held?.pointer !== event.pointerId) return;
    if (isScheduled) change(held.value);
    held = null;
  };
  element.addEventListener("pointerup", release);
  element.addEventListener("pointercancel", release);
}
