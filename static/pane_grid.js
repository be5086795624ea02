/** The panes of all cameras: laid out as large as they fit, or one of them filling the grid. */

import { Pane } from "./pane.js";

const GAP = 2;

export class PaneGrid {
  /** @type {Pane[]} */
  panes = [];
  #store;
  #gestures;
  #latency;
  #element;
  #cameras = "";
  #choice = "";

  /**
   * @param {HTMLElement} element
   * @param {import("./store.js").Store} store
   * @param {import("./gestures.js").Gestures} gestures
   * @param {import("./latency.js").Latency} latency
   */
  constructor(element, store, gestures, latency) {
    this.#element = element;
    this.#store = store;
    this.#gestures = gestures;
    this.#latency = latency;
    store.subscribe((changed) => this.#update(changed));
    new ResizeObserver(() => this.#layOut()).observe(element);
    // Moving the window to another screen changes the size of a device pixel, not that of the element.
    addEventListener("resize", () => this.#layOut());
  }

  /**
   * Let one pane fill the grid, or lead back where it does already.
   *
   * @param {number} camera
   */
  toggleFill(camera) {
    if (camera >= this.panes.length) return;
    this.#store.set({ filled: this.#store.facts.filled === camera ? null : camera, active: camera });
  }

  /** Show whole images: in the pane under the pointer, or else in all. */
  resetViews() {
    const under = this.panes.filter((pane) => pane.element.matches(":hover"));
    for (const pane of under.length ? under : this.panes) pane.reset();
  }

  /**
   * Where an undistorted pixel lies in the window.
   *
   * @param {number} camera
   * @param {number} u
   * @param {number} v
   */
  toClient(camera, u, v) {
    const pane = this.panes[camera];
    const box = pane.surface.getBoundingClientRect();
    const { x, y } = pane.view.toScreen(u, v);
    return { x: box.left + x, y: box.top + y };
  }

  /** @param {Set<keyof import("./store.js").Facts>} changed */
  #update(changed) {
    if (changed.has("session")) this.#build();
    if (changed.has("filled")) this.#layOut();
    if (changed.has("active") || changed.has("session")) this.#markActive();
    const withImage = changed.has("shown");
    // A new state comes with every move of a drag; only its choice of what to draw concerns the vectors.
    const { person, point, overlays } = this.#store.facts.state ?? {};
    const choice = JSON.stringify([person, point, overlays]);
    if (withImage || changed.has("overlay") || choice !== this.#choice || changed.has("hover")) {
      this.#choice = choice;
      for (const pane of this.panes) pane.draw(withImage);
    }
    if (changed.has("overlay")) this.#latency.painted(this.#store.facts.overlay?.seq ?? 0);
    if (changed.has("target") || withImage) {
      this.#element.classList.toggle("is-loading", this.#store.facts.shown?.frame !== this.#store.facts.target);
    }
    if (changed.has("state")) for (const pane of this.panes) pane.showCost();
  }

  #markActive() {
    const active = this.#store.facts.active ?? 0;
    this.panes.forEach((pane, camera) => pane.element.classList.toggle("is-active", camera === active));
  }

  #build() {
    const cameras = this.#store.facts.session?.cameras ?? [];
    // The session comes again with each connection: zoom and filled pane outlast it where the cameras are the same.
    const described = JSON.stringify(cameras);
    if (described === this.#cameras) return;
    this.#cameras = described;
    this.panes = cameras.map((info, camera) => {
      const pane = new Pane(this.#store, camera, info);
      this.#gestures.watch(pane, camera);
      pane.surface.addEventListener("dblclick", () => this.toggleFill(camera));
      return pane;
    });
    this.#element.replaceChildren(...this.panes.map((pane) => pane.element));
    this.#store.set({ filled: null });
    this.#layOut();
  }

  #layOut() {
    const cameras = this.#store.facts.session?.cameras ?? [];
    if (cameras.length === 0) return;
    const { filled } = this.#store.facts;
    const { clientWidth, clientHeight } = this.#element;
    const shown = filled === null ? cameras : [cameras[filled]];
    const aspect = Math.max(...shown.map(({ width, height }) => width / height));
    const columns = bestColumns(shown.length, clientWidth, clientHeight, aspect);
    const rows = Math.ceil(shown.length / columns);
    const width = Math.floor((clientWidth - GAP * (columns - 1)) / columns);
    const height = Math.floor((clientHeight - GAP * (rows - 1)) / rows);
    this.#element.style.gridTemplateColumns = `repeat(${columns}, minmax(0, 1fr))`;
    this.#element.style.gridAutoRows = `${height}px`;
    this.panes.forEach((pane, camera) => {
      const isShown = filled === null || filled === camera;
      pane.element.hidden = !isShown;
      pane.resize(isShown ? width : 0, isShown ? height : 0);
    });
  }
}

/**
 * The number of columns that gives the largest images.
 *
 * @param {number} count
 * @param {number} width
 * @param {number} height
 * @param {number} aspect of an image, width by height
 */
function bestColumns(count, width, height, aspect) {
  let best = { columns: 1, size: 0 };
  for (let columns = 1; columns <= count; columns += 1) {
    const size = Math.min(width / columns, (aspect * height) / Math.ceil(count / columns));
    if (size > best.size) best = { columns, size };
  }
  return best.columns;
}
