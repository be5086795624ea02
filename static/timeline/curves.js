/**
 * Curves of pose parameters or costs by frame (GD96 Fig. 8), on the axis of the timeline. A click goes to the frame, with
 * Shift a drag marks a range. Points of angles and lengths can be dragged. The program sends curves only while they are open.
 */

import { drawCurves, drawRings, pointAt, scalesOf } from "./curve_drawing.js";
import { CURVE_GROUPS } from "./drawer.js";
import { fillRect, prepare } from "../widgets/canvas.js";
import { button, byId, make } from "../widgets/elements.js";
import { FrameAxis } from "../widgets/frame_axis.js";
import { factorOf, numberField } from "../widgets/number_field.js";
import { toY } from "../widgets/plot.js";
import { lineSwatch } from "../widgets/series_lines.js";
import { zoomByWheel } from "./frame_window.js";
import { drawRange } from "./timeline_drawing.js";

/**
 * @typedef {import("../model/protocol.js").CurveGroup} CurveGroup
 * @typedef {import("../model/series.js").Curves} Data
 */

/** A shift is less than a turn. */
const MAX_SHIFT = 360;
const SIGNS = { deg: "°", cm: " cm", px: " px" };

/**
 * @param {import("../model/store.js").Store} store
 * @param {import("../model/navigation.js").Navigation} navigation
 * @param {import("../model/actions.js").Actions} actions
 * @param {import("./frame_window.js").FrameWindow} frameWindow
 * @param {import("../posing/curve_edits.js").CurveEdits} edits
 */
export function mountCurves(store, navigation, actions, frameWindow, edits) {
  const stage = byId("curves", HTMLElement);
  const legend = byId("curves-legend", HTMLElement);
  const personName = byId("curves-person", HTMLElement);
  const lines = make("canvas", "is-layer");
  const cursor = make("canvas", "is-layer");
  /** The group that is shown; null while the drawer is closed or shows another tab. */
  let shownGroup = /** @type {CurveGroup | null} */ (null);
  const { hidden } = edits;
  let hovered = /** @type {number | null} */ (null);
  /** The point under the pointer that can be dragged, and the values of the plots, as they were at the start of a drag. */
  let point = /** @type {ReturnType<typeof pointAt>} */ (null);
  let scales = /** @type {import("../widgets/plot.js").Scale[]} */ ([]);
  /** Start of the range that is being marked, or of the drag of a point, CSS pixels. */
  let [marked, heldY] = /** @type {[number | null, number]} */ ([null, 0]);
  /** The labels that the legend was built for. */
  let lastLabels = "";
  stage.append(lines, cursor);
  store.subscribe((changed) => update(changed));
  new ResizeObserver(() => drawAll()).observe(stage);
  store.on(["theme"], drawAll);
  listen();
  /** Keys while the curves have the focus: frames as on the timeline. @type {Record<string, (event: KeyboardEvent) => void>} */
  const keys = {
    ArrowLeft: () => navigation.step(-1),
    ArrowRight: () => navigation.step(1),
    PageDown: () => navigation.step(-10),
    PageUp: () => navigation.step(10),
    ArrowUp: (event) => edits.step(factorOf(event)),
    ArrowDown: (event) => edits.step(-factorOf(event)),
    U: (event) => edits.next(event.shiftKey),
    Escape: () => edits.cancel(),
  };
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
    stage.tabIndex = edits.choices().length > 0 ? 0 : -1;
    const moved = changed.has("curves") || changed.has("session") || changed.has("visible");
    if (moved || changed.has("timeline") || changed.has("lanes")) drawLines();
    if (moved || changed.has("target") || changed.has("range")) drawCursor();
  }

  /** Request the group of the open tab, or end the request. */
  function open() {
    const { drawer } = store.facts;
    const group = CURVE_GROUPS.find((one) => one === drawer) ?? null;
    if (group === null) personName.hidden = true;
    if (group === shownGroup) return;
    shownGroup = group;
    if (store.facts.connected) actions.openCurves(group);
    drawAll();
  }

  function listen() {
    stage.addEventListener("pointerdown", (event) => event.button === 0 && press(event));
    stage.addEventListener("pointermove", (event) => {
      const frame = axisNow().frameUnder(event, stage);
      if (edits.dragged() && point) return dragTo(point.plot, event);
      if (!stage.hasPointerCapture(event.pointerId)) point = offered(event);
      else if (marked === null) navigation.goTo(frame);
      else if (frame !== marked || store.facts.range) store.set({ range: { first: Math.min(frame, marked), last: Math.max(frame, marked) } });
      stage.classList.toggle("is-grab", point !== null);
      hover(frame);
    });
    stage.addEventListener("pointerup", () => edits.end());
    stage.addEventListener("pointercancel", () => edits.cancel());
    zoomByWheel(stage, frameWindow, () => axisNow());
    stage.addEventListener("pointerleave", () => {
      point = edits.dragged() ? point : null;
      hover(null);
    });
    stage.addEventListener("keydown", (event) => {
      const run = keys[event.key.length === 1 ? event.key.toUpperCase() : event.key];
      const isIdle = event.key === "Escape" ? !edits.dragged() : ["ArrowUp", "ArrowDown"].includes(event.key) && edits.why() !== null;
      if (!run || event.altKey || event.metaKey || isIdle) return;
      event.preventDefault();
      run(event);
    });
  }

  /** @param {PointerEvent} event */
  function press(event) {
    stage.setPointerCapture(event.pointerId);
    navigation.pause();
    const frame = axisNow().frameUnder(event, stage);
    const { range } = store.facts;
    const ofRange = event.shiftKey && range && range.first <= frame && frame <= range.last ? range : null;
    point = event.shiftKey && !ofRange ? null : offered(event);
    marked = event.shiftKey && !point ? frame : null;
    if (marked !== null) return store.set({ range: null });
    navigation.goTo(frame);
    if (!point) return;
    const toggles = event.ctrlKey || event.metaKey;
    edits.choose(point.dof, toggles);
    heldY = event.clientY;
    if (!toggles) edits.begin(frame, ofRange);
  }

  /**
   * @param {number} plot
   * @param {PointerEvent} event
   */
  function dragTo(plot, event) {
    const { min, max, top, bottom } = scales[plot];
    edits.move(((heldY - event.clientY) * (max - min)) / (bottom - top));
    if (edits.dragged()?.range) drawAll();
  }

  /** @param {PointerEvent} event */
  function offered(event) {
    const { left, top } = stage.getBoundingClientRect();
    const look = looked();
    const found = look && pointAt(look, axisNow(), { x: event.clientX - left, y: event.clientY - top });
    return found && edits.choices().includes(found.dof) ? found : null;
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
    edits.toggleHidden(label);
    element.setAttribute("aria-pressed", String(!hidden.has(label)));
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
    if (!edits.dragged()) scales = [];
    const look = looked();
    if (look) drawCurves(context, axisNow(), look, clientHeight, getComputedStyle(stage));
  }

  /** The visible curves and how they are drawn; the values of a range follow its drag, within the limits. */
  function looked() {
    const data = shownCurves();
    if (!data) return null;
    const { timeline, lanes } = store.facts;
    const shown = data.series.filter(({ label }) => !hidden.has(label));
    if (scales.length !== data.plots.length) scales = scalesOf({ ...data, series: shown }, stage.clientHeight);
    const series = edits.dragged()?.range ? shown.map((one) => ({ ...one, values: one.values.map((value, frame) => edits.moved(one.dof, frame, value)) })) : shown;
    return { curves: { ...data, series }, labels: labelsOf(data), scales, cells: lanes[data.person] ?? timeline, chosen: edits.chosen() };
  }

  /** Draw lines at the current frame and the pointer. The legend shows the values at the pointer, or else the frame. */
  function drawCursor() {
    const { clientWidth, clientHeight } = stage;
    if (clientWidth === 0 || shownGroup === null) return;
    const context = prepare(cursor, clientWidth, clientHeight, true);
    const style = getComputedStyle(stage);
    const axis = axisNow();
    const { target } = store.facts;
    if (store.facts.range) drawRange(context, axis, store.facts.range, style, clientHeight);
    const ink = style.getPropertyValue("--text");
    if (axis.shows(target)) fillRect(context, ink, axis.middle(target) - 0.5, 0, 1, clientHeight);
    if (hovered !== null) fillRect(context, ink, axis.middle(hovered) - 0.5, 0, 1, clientHeight, 0.5);
    readOut(hovered ?? target);
    const look = looked();
    if (!look) return;
    const ringed = look.curves.series.flatMap(({ dof, plot, values }) => {
      const frames = [...(look.chosen.includes(dof ?? -1) ? [target] : []), ...(point && point.dof === dof ? [point.frame] : [])];
      return frames.map((frame) => ({ x: axis.middle(frame), y: toY(look.scales[plot], values[frame]) }));
    });
    drawRings(context, ringed, ink);
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
 * Fields and buttons that smooth and shift the chosen curves in the marked range.
 *
 * @param {import("../model/store.js").Store} store
 * @param {import("../posing/curve_edits.js").CurveEdits} edits
 * @param {(text: string) => void} say
 */
export function mountCurveTools(store, edits, say) {
  const tools = byId("curve-tools", HTMLElement);
  const field = (/** @type {string} */ id, /** @type {string} */ name, /** @type {string} */ expected, /** @type {(value: number) => boolean} */ isGood) => {
    const take = (/** @type {string} */ text) => (text !== "" && isGood(Number(text)) ? null : `${name}: expected ${expected}, found “${text}”.`);
    const { element, show } = numberField({ name, take, refuse: say, step: null });
    const place = byId(id, HTMLElement);
    show(place.textContent ?? "");
    element.title = place.title;
    place.replaceWith(element);
    return () => Number(element.value.replace(",", "."));
  };
  const cutoff = field("curves-cutoff", "Cutoff", "a number of hertz above 0", (value) => value > 0);
  const shift = field("curves-shift", "Shift", "a number of degrees or centimetres below 360", (value) => Math.abs(value) < MAX_SHIFT);
  const run = (/** @type {"smooth" | "shift"} */ action, /** @type {() => number} */ amount) => () => {
    const why = edits.whyNoRange();
    if (why) say(why);
    else edits.editRange(action, amount());
  };
  button("smooth-curves", run("smooth", cutoff));
  button("shift-curves", run("shift", shift));
  store.on(["curves", "drawer", "state", "session", "connected"], () => {
    const count = edits.chosen().length;
    tools.hidden = count === 0;
    byId("curves-chosen", HTMLElement).textContent = count === 1 ? "1 curve" : `${count} curves`;
    byId("curves-unit", HTMLElement).textContent = SIGNS[edits.unit()];
  });
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
