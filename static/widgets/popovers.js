/** Popover panels: a button opens them; Esc or a click outside closes them. */

import { make } from "./elements.js";

const MARGIN_PX = 8;

/**
 * Open a panel below or above a button, inside the window, or close it if it is open.
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
 * Let a button open a panel. The press on the button closes an open panel before the click, which must not open it again.
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

/** Close the open popover. Returns whether one was open. */
export function closePopover() {
  const open = document.querySelector(":popover-open");
  if (open instanceof HTMLElement) open.hidePopover();
  return open !== null;
}

/**
 * Make a slider that shows its value as text.
 *
 * @param {{label: string, title: string, min: number, max: number, step: number,
 *   format: (value: number) => string, onInput: (value: number) => void}} options
 */
export function slider({ label, title, min, max, step, format, onInput }) {
  const input = make("input", { type: "range", min: String(min), max: String(max), step: String(step), title, "aria-label": label });
  const value = make("output");
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
