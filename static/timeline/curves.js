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

/**
 * @param {import("../model/store.js").Store} store
 * @param {import("../model/navigation.js").Navigation} navigation
 * @param {import("../model/actions.js").Actions} actions
 * @param {import("./frame_window.js").FrameWindow} frameWindow
 */
export function mountCurves(store, navigation, actions, frameWindow) {
  const stage = byId("curves", HTMLElement);
  const legend = byId("curves-legend", HTMLElement);
  const personName = byId("curves-person", HTMLElement);
  const lines = make("canvas", "is-layer");
  const cursor = make("canvas", "is-layer");
  /** The group that is shown; null while the drawer is closed or shows another tab. */
  let shownGroup = /** @type {CurveGroup | null} */ (null);
  /** Names of the curves that are switched off. */
  const hidden = new Set(/** @type {string[]} */ (JSON.parse(localStorage.getItem(STORED_HIDDEN) ?? "[]")));
  let hovered = /** @type {number | null} */ (null);
  /** The labels that the legend was built for. */
  let lastLabels = "";
  stage.append(lines, cursor);
  store.subscribe((changed) => update(changed));
  new ResizeObserver(() => drawAll()).observe(stage);
  store.on(["theme"], drawAll);
  listen();
  open();

  /** The curves to draw; null while they are loading. */
  function shownCurves() {
    const { curves } = store.facts;
    return shownGroup !== null && curves?.group === shownGroup ? curves : null;
  }

  function axisNow() {
    const { session, visible } = store.facts;
    return new FrameAxis(stage.clientWidth, session?.n_frames ?? 1, visible);
  }

  /** @param {Set<keyof import("../model/store.js").Facts>} changed */
  function update(changed) {
    if (changed.has("drawer")) open();
    if (shownGroup === null) return;
    if (changed.has("connected") && store.facts.connected) actions.openCurves(shownGroup);
    if (changed.has("curves")) describe();
    const moved = changed.has("curves") || changed.has("session") || changed.has("visible");
    if (moved || changed.has("timeline") || changed.has("lanes")) drawLines();
    if (moved || changed.has("target")) drawCursor();
  }

  /** Request the group of the open tab, or end the request. */
  function open() {
    const { drawer } = store.facts;
    const group = CURVE_GROUPS.find((one) => one === drawer) ?? null;
    stage.hidden = legend.hidden = group === null;
    if (group === null) personName.hidden = true;
    if (group === shownGroup) return;
    shownGroup = group;
    if (store.facts.connected) actions.openCurves(group);
    drawAll();
  }

  function listen() {
    stage.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      stage.setPointerCapture(event.pointerId);
      navigation.pause();
      navigation.goTo(axisNow().frameUnder(event, stage));
    });
    stage.addEventListener("pointermove", (event) => {
      const frame = axisNow().frameUnder(event, stage);
      if (stage.hasPointerCapture(event.pointerId)) navigation.goTo(frame);
      if (frame !== hovered) hover(frame);
    });
    zoomByWheel(stage, frameWindow, () => axisNow());
    stage.addEventListener("pointerleave", () => hover(null));
  }

  /** @param {number | null} frame */
  function hover(frame) {
    hovered = frame;
    requestAnimationFrame(() => drawCursor());
  }

  /** Build the legend: one switch per name, for the curves of that name in all plots. */
  function describe() {
    const data = shownCurves();
    showPerson(data);
    const labels = labelsOf(data);
    const described = JSON.stringify(labels);
    if (!data || described === lastLabels) return;
    lastLabels = described;
    legend.replaceChildren(
      ...labels.map((label, index) => {
        const one = make("button", { type: "button", className: "legend-switch", "aria-pressed": String(!hidden.has(label)), title: `Show or hide ${label}` }, lineSwatch(index), label, make("output"));
        one.addEventListener("click", () => toggleCurve(one, label));
        return one;
      }),
    );
  }

  /**
   * Show the person's name if there are several people.
   *
   * @param {Data | null} data
   */
  function showPerson(data) {
    const people = store.facts.session?.people ?? [];
    const person = data && people.length > 1 ? people[data.person] : null;
    personName.hidden = !person;
    personName.textContent = person?.name ?? "";
    personName.title = person ? `Curves of ${person.name} (P: next person)` : "";
    personName.style.setProperty("--person", person?.color ?? "");
  }

  /**
   * @param {HTMLButtonElement} element
   * @param {string} label
   */
  function toggleCurve(element, label) {
    element.blur();
    if (!hidden.delete(label)) hidden.add(label);
    element.setAttribute("aria-pressed", String(!hidden.has(label)));
    localStorage.setItem(STORED_HIDDEN, JSON.stringify([...hidden]));
    drawLines();
  }

  function drawAll() {
    if (shownGroup === null) return;
    drawLines();
    drawCursor();
  }

  function drawLines() {
    const { clientWidth, clientHeight } = stage;
    if (clientWidth === 0) return;
    const context = prepare(lines, clientWidth, clientHeight, true);
    const data = shownCurves();
    if (!data) return;
    const { timeline, lanes } = store.facts;
    const keyframes = keyframesOf(lanes[data.person] ?? timeline);
    const style = getComputedStyle(stage);
    drawCurves(context, axisNow(), clientHeight, data, labelsOf(data), hidden, keyframes, style);
  }

  /** Draw lines at the current frame and the pointer. The legend shows the values at the pointer, or else the frame. */
  function drawCursor() {
    const { clientWidth, clientHeight } = stage;
    if (clientWidth === 0 || shownGroup === null) return;
    const context = prepare(cursor, clientWidth, clientHeight, true);
    const style = getComputedStyle(stage);
    const axis = axisNow();
    const { target } = store.facts;
    context.fillStyle = style.getPropertyValue("--text");
    if (axis.shows(target)) context.fillRect(axis.middle(target) - 0.5, 0, 1, clientHeight);
    if (hovered !== null) {
      context.globalAlpha = 0.5;
      context.fillRect(axis.middle(hovered) - 0.5, 0, 1, clientHeight);
      context.globalAlpha = 1;
    }
    readOut(hovered ?? target);
  }

  /** @param {number} frame */
  function readOut(frame) {
    const data = shownCurves();
    labelsOf(data).forEach((label, index) => {
      const value = legend.children[index]?.querySelector("output");
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
