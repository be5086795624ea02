/**
 * Curves of pose parameters or costs by frame (GD96 Fig. 8), on the axis of the timeline. A click goes to the frame. The
 * program sends curves only while they are open.
 */

import { drawCurves } from "./curve_drawing.js";
import { CURVE_GROUPS } from "./drawer.js";
import { prepare } from "../panes/drawing.js";
import { byId, make } from "../widgets/elements.js";
import { FrameAxis } from "../widgets/frame_axis.js";
import { lineSwatch } from "../widgets/series_lines.js";
import { zoomByWheel } from "./frame_window.js";
import { keyframesOf } from "../model/cells.js";

/**
 * @typedef {import("../model/protocol.js").CurveGroup} CurveGroup
 * @typedef {import("../model/series.js").Curves} Data
 */

const STORED_HIDDEN = "quadrille.curves-hidden";
const SIGNS = { deg: "°", cm: " cm", px: " px" };

export class Curves {
  #store;
  #navigation;
  #actions;
  #frameWindow;
  #stage = byId("curves", HTMLElement);
  #legend = byId("curves-legend", HTMLElement);
  #person = byId("curves-person", HTMLElement);
  #lines = make("canvas");
  #cursor = make("canvas");
  /** The group that is shown; null while the drawer is closed or shows another tab. */
  #group = /** @type {CurveGroup | null} */ (null);
  /** Names of the curves that are switched off. */
  #hidden = new Set(/** @type {string[]} */ (JSON.parse(localStorage.getItem(STORED_HIDDEN) ?? "[]")));
  #hovered = /** @type {number | null} */ (null);
  /** The labels that the legend was built for. */
  #described = "";

  /**
   * @param {import("../model/store.js").Store} store
   * @param {import("../model/navigation.js").Navigation} navigation
   * @param {import("../model/actions.js").Actions} actions
   * @param {import("./frame_window.js").FrameWindow} frameWindow
   */
  constructor(store, navigation, actions, frameWindow) {
    this.#store = store;
    this.#navigation = navigation;
    this.#actions = actions;
    this.#frameWindow = frameWindow;
    this.#stage.append(this.#lines, this.#cursor);
    store.subscribe((changed) => this.#update(changed));
    new ResizeObserver(() => this.#drawAll()).observe(this.#stage);
    store.on(["theme"], () => this.#drawAll());
    this.#listen();
    this.#open();
  }

  /** The curves to draw; null while they are loading. */
  get #data() {
    const { curves } = this.#store.facts;
    return this.#group !== null && curves?.group === this.#group ? curves : null;
  }

  get #axis() {
    const { session, visible } = this.#store.facts;
    return new FrameAxis(this.#stage.clientWidth, session?.n_frames ?? 1, visible);
  }

  /** @param {Set<keyof import("../model/store.js").Facts>} changed */
  #update(changed) {
    if (changed.has("drawer")) this.#open();
    if (this.#group === null) return;
    if (changed.has("connected") && this.#store.facts.connected) this.#actions.openCurves(this.#group);
    if (changed.has("curves")) this.#describe();
    const moved = changed.has("curves") || changed.has("session") || changed.has("visible");
    if (moved || changed.has("timeline") || changed.has("lanes")) this.#drawLines();
    if (moved || changed.has("target")) this.#drawCursor();
  }

  /** Request the group of the open tab, or end the request. */
  #open() {
    const { drawer } = this.#store.facts;
    const group = CURVE_GROUPS.find((one) => one === drawer) ?? null;
    this.#stage.hidden = this.#legend.hidden = group === null;
    if (group === null) this.#person.hidden = true;
    if (group === this.#group) return;
    this.#group = group;
    if (this.#store.facts.connected) this.#actions.openCurves(group);
    this.#drawAll();
  }

  #listen() {
    const stage = this.#stage;
    stage.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      stage.setPointerCapture(event.pointerId);
      this.#navigation.pause();
      this.#navigation.goTo(this.#axis.frameUnder(event, stage));
    });
    stage.addEventListener("pointermove", (event) => {
      const frame = this.#axis.frameUnder(event, stage);
      if (stage.hasPointerCapture(event.pointerId)) this.#navigation.goTo(frame);
      if (frame !== this.#hovered) this.#hover(frame);
    });
    zoomByWheel(stage, this.#frameWindow, () => this.#axis);
    stage.addEventListener("pointerleave", () => this.#hover(null));
  }

  /** @param {number | null} frame */
  #hover(frame) {
    this.#hovered = frame;
    requestAnimationFrame(() => this.#drawCursor());
  }

  /** Build the legend: one switch per name, for the curves of that name in all plots. */
  #describe() {
    const data = this.#data;
    this.#showPerson(data);
    const labels = labelsOf(data);
    const described = JSON.stringify(labels);
    if (!data || described === this.#described) return;
    this.#described = described;
    this.#legend.replaceChildren(
      ...labels.map((label, index) => {
        const one = make("button", { type: "button", className: "legend-switch", "aria-pressed": String(!this.#hidden.has(label)), title: `Show or hide ${label}` }, lineSwatch(index), label, make("output"));
        one.addEventListener("click", () => this.#switch(one, label));
        return one;
      }),
    );
  }

  /**
   * Show the person's name if there are several people.
   *
   * @param {Data | null} data
   */
  #showPerson(data) {
    const people = this.#store.facts.session?.people ?? [];
    const person = data && people.length > 1 ? people[data.person] : null;
    this.#person.hidden = !person;
    this.#person.textContent = person?.name ?? "";
    this.#person.title = person ? `Curves of ${person.name} (P: next person)` : "";
    this.#person.style.setProperty("--person", person?.color ?? "");
  }

  /**
   * @param {HTMLButtonElement} element
   * @param {string} label
   */
  #switch(element, label) {
    element.blur();
    if (!this.#hidden.delete(label)) this.#hidden.add(label);
    element.setAttribute("aria-pressed", String(!this.#hidden.has(label)));
    localStorage.setItem(STORED_HIDDEN, JSON.stringify([...this.#hidden]));
    this.#drawLines();
  }

  #drawAll() {
    if (this.#group === null) return;
    this.#drawLines();
    this.#drawCursor();
  }

  #drawLines() {
    const { clientWidth, clientHeight } = this.#stage;
    if (clientWidth === 0) return;
    const context = prepare(this.#lines, clientWidth, clientHeight, true);
    const data = this.#data;
    if (!data) return;
    const { timeline, lanes } = this.#store.facts;
    const keyframes = keyframesOf(lanes[data.person] ?? timeline);
    const style = getComputedStyle(this.#stage);
    drawCurves(context, this.#axis, clientHeight, data, labelsOf(data), this.#hidden, keyframes, style);
  }

  /** Draw lines at the current frame and the pointer. The legend shows the values at the pointer, or else the frame. */
  #drawCursor() {
    const { clientWidth, clientHeight } = this.#stage;
    if (clientWidth === 0 || this.#group === null) return;
    const context = prepare(this.#cursor, clientWidth, clientHeight, true);
    const style = getComputedStyle(this.#stage);
    const axis = this.#axis;
    const { target } = this.#store.facts;
    context.fillStyle = style.getPropertyValue("--text");
    if (axis.shows(target)) context.fillRect(axis.middle(target) - 0.5, 0, 1, clientHeight);
    if (this.#hovered !== null) {
      context.globalAlpha = 0.5;
      context.fillRect(axis.middle(this.#hovered) - 0.5, 0, 1, clientHeight);
      context.globalAlpha = 1;
    }
    this.#readOut(this.#hovered ?? target);
  }

  /** @param {number} frame */
  #readOut(frame) {
    const data = this.#data;
    labelsOf(data).forEach((label, index) => {
      const value = this.#legend.children[index]?.querySelector("output");
      if (!value || !data) return;
      const found = data.series.filter((one) => one.label === label);
      value.textContent = found
        .map(({ plot, values }) => (found.length > 1 ? `${data.plots[plot].title[0]} ` : "") + write(data, plot, values[frame]))
        .join("  ");
      value.title = found
        .map(({ plot, values }) => `${data.plots[plot].title} at frame ${frame}: ${write(data, plot, values[frame])}`)
        .join("\n");
    });
  }
}

/**
 * Unique names of the curves.
 *
 * @param {Data | null} data
 */
function labelsOf(data) {
  return [...new Set(data?.series.map(({ label }) => label))];
}

/**
 * @param {Data} data
 * @param {number} plot
 * @param {number} value
 */
function write(data, plot, value) {
  const { unit } = data.plots[plot];
  return Number.isFinite(value) ? `${value.toFixed(unit === "px" ? 2 : 1)}${SIGNS[unit]}` : "–";
}
