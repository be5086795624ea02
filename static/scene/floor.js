/** Set the floor: a bar with instructions, and clicks in the panes that mark points on the floor. */

import { button, byId } from "../widgets/elements.js";
import { px } from "../widgets/text.js";

/** A click that moves farther is a pan. */
const CLICK_PX = 4;
const POINTS = 3;

export class Floor {
  #store;
  #send;
  #grid;
  #bar = byId("floor-bar", HTMLElement);
  #text = byId("floor-text", HTMLElement);
  #panes;
  #next;
  #back;
  /** @type {{pointer: number, x: number, y: number} | null} */
  #pressed = null;

  /**
   * @param {HTMLElement} panes
   * @param {import("../model/store.js").Store} store
   * @param {import("../panes/pane_grid.js").PaneGrid} grid
   * @param {(message: import("../model/protocol.js").ClientMessage) => void} send
   */
  constructor(panes, store, grid, send) {
    this.#panes = panes;
    this.#store = store;
    this.#grid = grid;
    this.#send = send;
    this.#next = button("floor-next", () => this.goOn());
    this.#back = button("floor-back", () => this.takeBack());
    button("floor-cancel", () => this.cancel());
    panes.addEventListener("pointerdown", (event) => this.#down(event), { capture: true });
    panes.addEventListener("pointerup", (event) => this.#up(event), { capture: true });
    // A double-click sets two marks and must not fill the grid.
    panes.addEventListener("dblclick", (event) => this.isOn && event.stopPropagation(), { capture: true });
    store.on(["state"], () => this.#show());
  }

  /** Whether the floor is being set. */
  get isOn() {
    return !!this.#store.facts.state?.floor;
  }

  /** Start setting the floor, or cancel it. */
  toggle() {
    this.#send({ type: "floor", action: this.isOn ? "cancel" : "begin" });
  }

  /** Continue with the next point, or apply the plane after the last one. */
  goOn() {
    const { floor } = this.#store.facts.state ?? {};
    if (floor) this.#send({ type: "floor", action: floor.point === POINTS ? "apply" : "next" });
  }

  takeBack() {
    if (this.isOn) this.#send({ type: "floor", action: "take_back" });
  }

  /** Set it to the plane under the feet of the people. */
  setFromFeet() {
    this.#send({ type: "floor", action: "from_feet" });
  }

  /** Restore the floor before the last change. */
  revert() {
    this.#send({ type: "floor", action: "revert" });
  }

  /** Cancel setting the floor. Returns whether it was being set. */
  cancel() {
    if (!this.isOn) return false;
    this.#send({ type: "floor", action: "cancel" });
    return true;
  }

  /** @param {PointerEvent} event */
  #down(event) {
    const isClick = this.isOn && event.button === 0;
    this.#pressed = isClick ? { pointer: event.pointerId, x: event.clientX, y: event.clientY } : null;
  }

  /** @param {PointerEvent} event */
  #up(event) {
    const pressed = this.#pressed;
    this.#pressed = null;
    if (!pressed || event.pointerId !== pressed.pointer || !this.isOn) return;
    if (Math.hypot(event.clientX - pressed.x, event.clientY - pressed.y) > CLICK_PX) return;
    const camera = this.#grid.panes.findIndex((pane) => pane.surface === event.target);
    if (camera < 0) return;
    const pane = this.#grid.panes[camera];
    const at = pane.locate(event);
    this.#send({ type: "floor", action: "mark", camera, ...pane.view.toImage(at.x, at.y) });
  }

  #show() {
    const floor = this.#store.facts.state?.floor ?? null;
    this.#bar.hidden = !floor;
    this.#panes.classList.toggle("is-picking", !!floor);
    if (!floor) return;
    const isLast = floor.point === POINTS;
    const text = `Floor, point ${floor.point} of ${POINTS}: ${instruction(floor)}`;
    if (this.#text.textContent !== text) this.#text.textContent = text;
    this.#next.textContent = isLast ? "Apply" : "Next point";
    this.#next.title = isLast ? "Use this plane as the floor (Enter)" : "Continue with the next point (Enter)";
    this.#next.disabled = isLast ? !floor.ready : !floor.known;
    this.#back.disabled = !floor.marked;
  }
}

/** @param {import("../model/protocol.js").FloorPicking} floor */
function instruction(floor) {
  if (floor.views === 0) return "click a point on the floor";
  if (!floor.known) return floor.why;
  if (floor.point === POINTS && !floor.ready) return floor.why;
  return `${floor.views} views agree within ${px(floor.error_px)}; more views improve the accuracy`;
}
