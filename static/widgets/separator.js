/** Separators between two parts of the page, moved by pointer or arrow keys and reset by a double-click. */

const KEY_STEP_PX = 24;

/**
 * @typedef {object} Movement
 * @property {() => number} position where the separator is, CSS pixels; larger to the right or downwards
 * @property {(position: number) => void} moveTo moves it, as far as it can go
 * @property {() => void} reset
 */

/**
 * Let a separator be moved.
 *
 * @param {HTMLElement} bar with `aria-orientation`
 * @param {Movement} movement
 */
export function makeSeparator(bar, { position, moveTo, reset }) {
  const isVertical = bar.getAttribute("aria-orientation") === "vertical";
  onDrag(bar, () => {
    const start = position();
    return (dx, dy) => moveTo(start + (isVertical ? dx : dy));
  });
  bar.addEventListener("dblclick", (event) => {
    event.stopPropagation();
    reset();
  });
  bar.addEventListener("keydown", (event) => {
    const [back, on] = isVertical ? ["ArrowLeft", "ArrowRight"] : ["ArrowUp", "ArrowDown"];
    if (event.key !== back && event.key !== on) return;
    event.preventDefault();
    moveTo(position() + (event.key === on ? KEY_STEP_PX : -KEY_STEP_PX));
  });
}

/**
 * Call back while an element is dragged. The 3-D view gets no pointer meanwhile.
 *
 * @param {HTMLElement} element
 * @param {() => ((dx: number, dy: number) => void)} begin starts a drag; what it returns is called with the distance from
 *   its start
 */
export function onDrag(element, begin) {
  /** @type {{x: number, y: number, move: (dx: number, dy: number) => void} | null} */
  let drag = null;
  element.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    drag = { x: event.clientX, y: event.clientY, move: begin() };
    element.setPointerCapture(event.pointerId);
    element.classList.add("is-moved");
    document.body.classList.add("is-resizing");
  });
  element.addEventListener("pointermove", (event) => {
    if (element.hasPointerCapture(event.pointerId)) drag?.move(event.clientX - drag.x, event.clientY - drag.y);
  });
  element.addEventListener("lostpointercapture", () => {
    drag = null;
    element.classList.remove("is-moved");
    document.body.classList.remove("is-resizing");
  });
  // The focus would keep the arrow keys after a drag.
  element.addEventListener("mousedown", (event) => event.preventDefault());
}

/**
 * Tell screen readers where a separator is.
 *
 * @param {HTMLElement} bar
 * @param {{now: number, min: number, max: number}} values
 */
export function showPosition(bar, { now, min, max }) {
  bar.setAttribute("aria-valuenow", String(Math.round(now)));
  bar.setAttribute("aria-valuemin", String(Math.round(min)));
  bar.setAttribute("aria-valuemax", String(Math.round(max)));
}
