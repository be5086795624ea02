/** Small panels over the page: opened at a button, closed by a click elsewhere or by Esc. */

const MARGIN_PX = 8;

/**
 * Open a panel below or above a button, within the window; close it where it is open already.
 *
 * @param {HTMLElement} panel
 * @param {HTMLElement} button
 */
export function togglePopover(panel, button) {
  if (panel.matches(":popover-open")) {
    panel.hidePopover();
    return;
  }
  panel.showPopover();
  const at = button.getBoundingClientRect();
  const { width, height } = panel.getBoundingClientRect();
  const below = at.bottom + MARGIN_PX;
  const fitsBelow = below + height + MARGIN_PX <= innerHeight;
  const top = fitsBelow ? below : Math.max(MARGIN_PX, at.top - height - MARGIN_PX);
  const left = Math.max(MARGIN_PX, Math.min(at.left, innerWidth - width - MARGIN_PX));
  Object.assign(panel.style, { top: `${top}px`, left: `${left}px` });
}

/**
 * Let a button open a panel. Its press closes an open one before the click comes: that click means "close".
 *
 * @param {HTMLElement} panel
 * @param {HTMLElement} button
 * @param {() => void} toggle
 */
export function opensPopover(panel, button, toggle) {
  let wasOpen = false;
  button.addEventListener("pointerdown", () => (wasOpen = panel.matches(":popover-open")));
  button.addEventListener("click", () => {
    if (!wasOpen) toggle();
    wasOpen = false;
  });
  panel.addEventListener("toggle", () => button.setAttribute("aria-expanded", String(panel.matches(":popover-open"))));
}

/** Close what is open; says whether anything was. */
export function closePopover() {
  const open = document.querySelector(":popover-open");
  if (open instanceof HTMLElement) open.hidePopover();
  return open !== null;
}

/**
 * A slider with a caption and its value in words.
 *
 * @param {{label: string, title: string, least: number, most: number, step: number,
 *   format: (value: number) => string, onInput: (value: number) => void}} options
 */
export function slider({ label, title, least, most, step, format, onInput }) {
  const input = document.createElement("input");
  Object.assign(input, { type: "range", min: String(least), max: String(most), step: String(step), title });
  input.setAttribute("aria-label", label);
  const value = document.createElement("output");
  const show = (/** @type {number} */ shown) => {
    input.value = String(shown);
    value.textContent = format(shown);
    input.setAttribute("aria-valuetext", value.textContent);
  };
  input.addEventListener("input", () => {
    show(Number(input.value));
    onInput(Number(input.value));
  });
  return { input, value, show };
}
