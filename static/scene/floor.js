/** Set the floor: a bar with instructions, and clicks in the panes that mark points on the floor. */

import { button, byId } from "../widgets/elements.js";
import { px } from "../widgets/text.js";

/** A click that moves farther is a pan. */
const CLICK_PX = 4;
const POINTS = 3;

/** @typedef {ReturnType<typeof makeFloor>} Floor */

/**
 * @param {HTMLElement} panes
 * @param {import("../model/store.js").Store} store
 * @param {import("../panes/pane_grid.js").PaneGrid} grid
 * @param {(message: import("../model/protocol.js").ClientMessage) => void} send
 */
export function makeFloor(panes, store, grid, send) {
  const bar = byId("floor-bar", HTMLElement);
  const instructions = byId("floor-text", HTMLElement);
  /** @type {{pointer: number, x: number, y: number} | null} */
  let pressed = null;

  const next = button("floor-next", goOn);
  const back = button("floor-back", () => takeBack());
  button("floor-cancel", cancel);
  panes.addEventListener("pointerdown", down, { capture: true });
  panes.addEventListener("pointerup", up, { capture: true });
  // A double-click sets two marks and must not fill the grid.
  panes.addEventListener("dblclick", (event) => isOn() && event.stopPropagation(), { capture: true });
  store.on(["state"], show);

  /** Whether the floor is being set. */
  const isOn = () => !!store.facts.state?.floor;

  /** Start setting the floor, or cancel it. */
  const toggle = () => send({ type: "floor", action: isOn() ? "cancel" : "begin" });

  /** Continue with the next point, or apply the plane after the last one. */
  function goOn() {
    const { floor } = store.facts.state ?? {};
    if (floor) send({ type: "floor", action: floor.point === POINTS ? "apply" : "next" });
  }

  const takeBack = () => isOn() && send({ type: "floor", action: "take_back" });

  /** Set it to the plane under the feet of the people. */
  const setFromFeet = () => send({ type: "floor", action: "from_feet" });

  /** Restore the floor before the last change. */
  const revert = () => send({ type: "floor", action: "revert" });

  /** Cancel setting the floor. Returns whether it was being set. */
  function cancel() {
    if (!isOn()) return false;
    send({ type: "floor", action: "cancel" });
    return true;
  }

  /** @param {PointerEvent} event */
  function down(event) {
    const isClick = isOn() && event.button === 0;
    pressed = isClick ? { pointer: event.pointerId, x: event.clientX, y: event.clientY } : null;
  }

  /** @param {PointerEvent} event */
  function up(event) {
    const start = pressed;
    pressed = null;
    if (!start || event.pointerId !== start.pointer || !isOn()) return;
    if (Math.hypot(event.clientX - start.x, event.clientY - start.y) > CLICK_PX) return;
    const camera = grid.panes.findIndex((pane) => pane.surface === event.target);
    if (camera < 0) return;
    const pane = grid.panes[camera];
    const at = pane.locate(event);
    send({ type: "floor", action: "mark", camera, ...pane.view.toImage(at.x, at.y) });
  }

  function show() {
    const floor = store.facts.state?.floor ?? null;
    bar.hidden = !floor;
    panes.classList.toggle("is-picking", !!floor);
    if (!floor) return;
    const isLast = floor.point === POINTS;
    const text = `Floor, point ${floor.point} of ${POINTS}: ${instruction(floor)}`;
    if (instructions.textContent !== text) instructions.textContent = text;
    next.textContent = isLast ? "Apply" : "Next point";
    next.title = isLast ? "Use this plane as the floor (Enter)" : "Continue with the next point (Enter)";
    next.disabled = isLast ? !floor.ready : !floor.known;
    back.disabled = !floor.marked;
  }

  return { isOn, toggle, goOn, takeBack, setFromFeet, revert, cancel };
}

/** @param {import("../model/protocol.js").FloorPicking} floor */
function instruction(floor) {
  if (floor.views === 0) return "click a point on the floor";
  if (!floor.known) return floor.why;
  if (floor.point === POINTS && !floor.ready) return floor.why;
  return `${floor.views} views agree within ${px(floor.error_px)}; more views improve the accuracy`;
}
