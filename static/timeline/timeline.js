/**
 * Timeline: one cell per frame, coloured by source, with cost and status above and review marks below. A click or drag goes
 * to a frame; with Shift it marks a range. The strip at the bottom is an overview of the whole recording.
 */

import { drawWithin, fillRect, prepare } from "../widgets/canvas.js";
import { make } from "../widgets/elements.js";
import { AMBIGUOUS, framesWith, keyframesOf } from "../model/cells.js";
import { filterTest } from "../model/provenance.js";
import { earlierCalibration } from "../model/selectors.js";
import { statesByFrame } from "../model/tasks.js";
import { describeFrame } from "./cell_text.js";
import { drawCopy, drawDimmed } from "./cell_marks.js";
import { mountCellTip } from "./cell_tip.js";
import { FrameAxis } from "../widgets/frame_axis.js";
import { zoomByWheel } from "./frame_window.js";
import * as drawing from "./timeline_drawing.js";

/** Margin of the overview for the pointer. */
const REACH = 1;
const MIDDLE_BUTTON = 1;

/** @typedef {"scrub" | "mark" | "pan" | "overview"} Gesture of the pointer while it is down */

/** Facts that cells are drawn from and described by. @type {(keyof import("../model/store.js").Facts)[]} */
const CELL_FACTS = ["timeline", "lanes", "session", "keyframeDoubts", "calibration"];

/**
 * @param {HTMLElement} element
 * @param {{store: import("../model/store.js").Store, navigation: import("../model/navigation.js").Navigation,
 *   jumps: import("./jumps.js").Jumps, frameWindow: import("./frame_window.js").FrameWindow}} parts
 */
export function mountTimeline(element, { store, navigation, jumps, frameWindow }) {
  const cellCanvas = make("canvas", "is-layer");
  const cursor = make("canvas", "is-layer");
  let hovered = /** @type {number | null} */ (null);
  let gesture = /** @type {Gesture | null} */ (null);
  /** Start of the range that is being marked. */
  let marked = 0;
  /** Position that stays under the pointer while panning. */
  let held = 0;
  element.append(cellCanvas, cursor);
  const tip = mountCellTip(element);
  store.on(["session", "annotation", "otherCopy"], () => (element.style.height = `${layout().height}px`));
  store.on([...CELL_FACTS, "visible", "annotation", "otherCopy", "provenanceFilter", "annotators"], drawCells);
  store.on(["target", "session", "range", "visible", "annotation"], drawCursor);
  store.on([...CELL_FACTS, "target"], describe);
  new ResizeObserver(() => drawAll()).observe(element);
  store.on(["theme"], drawAll);
  listen();

  function layout() {
    const { session, annotation, otherCopy } = store.facts;
    return drawing.layout(session?.people.length ?? 1, !!annotation?.tasks.length, otherCopy !== null);
  }

  function frameAxis() {
    return new FrameAxis(element.clientWidth, store.facts.session?.n_frames ?? 1, store.facts.visible);
  }

  /** Axis of the overview. */
  function whole() {
    return new FrameAxis(element.clientWidth, store.facts.session?.n_frames ?? 1, null);
  }

  function listen() {
    element.addEventListener("pointerdown", (event) => press(event));
    element.addEventListener("pointermove", (event) => {
      if (gesture) drag(event);
      const frame = isOverview(event) ? null : frameAxis().frameUnder(event, element);
      const lane = laneUnder(event);
      if (frame === null || gesture) tip.hide();
      else tip.show(describeFrame(frame, store.facts, lane), event.clientX);
      element.title = frame === null ? "Overview of the recording: drag to move the visible part" : "";
      if (frame === hovered) return;
      hovered = frame;
      requestAnimationFrame(() => drawCursor());
    });
    for (const end of /** @type {const} */ (["pointerup", "pointercancel"])) {
      element.addEventListener(end, () => {
        gesture = null;
        element.classList.remove("is-panning");
      });
    }
    element.addEventListener("pointerleave", () => {
      hovered = null;
      tip.hide();
      requestAnimationFrame(() => drawCursor());
    });
    element.addEventListener("dblclick", (event) => {
      if (isOverview(event)) frameWindow.zoom(0, 0);
      else store.set({ range: jumps.intervalAround(frameAxis().frameUnder(event, element)) });
    });
    zoomByWheel(element, frameWindow, () => frameAxis());
    element.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: -1, ArrowRight: 1, PageDown: -10, PageUp: 10 }[event.key];
      if (step === undefined || event.ctrlKey || event.altKey || event.metaKey) return;
      event.preventDefault();
      navigation.step(step);
    });
  }

  /** @param {PointerEvent} event */
  function press(event) {
    if (event.button !== 0 && event.button !== MIDDLE_BUTTON) return;
    event.preventDefault();
    element.setPointerCapture(event.pointerId);
    const frame = frameAxis().frameUnder(event, element);
    if (event.button === MIDDLE_BUTTON) {
      gesture = "pan";
      held = placeUnder(event);
      element.classList.add("is-panning");
    } else if (store.facts.visible && isOverview(event)) {
      gesture = "overview";
      drag(event);
    } else if (event.shiftKey) {
      gesture = "mark";
      marked = frame;
      store.set({ range: null });
    } else {
      gesture = "scrub";
      navigation.pause();
      navigation.goTo(frame);
    }
  }

  /** @param {PointerEvent} event */
  function drag(event) {
    const frame = frameAxis().frameUnder(event, element);
    if (gesture === "scrub") navigation.goTo(frame);
    else if (gesture === "pan") frameWindow.move(held - placeUnder(event));
    else if (gesture === "overview") frameWindow.centre(whole().placeAt(x(event)));
    else if (frame !== marked || store.facts.range) {
      store.set({ range: { first: Math.min(frame, marked), last: Math.max(frame, marked) } });
    }
  }

  /** @param {MouseEvent} event */
  function x(event) {
    return event.clientX - element.getBoundingClientRect().left;
  }

  /** @param {MouseEvent} event */
  function placeUnder(event) {
    return frameAxis().placeAt(x(event));
  }

  /** @param {MouseEvent} event */
  function isOverview(event) {
    return event.clientY - element.getBoundingClientRect().top >= layout().overview.top - REACH;
  }

  /**
   * Index of the person whose lane is under the pointer; null beside the lanes, and where there is only one person.
   *
   * @param {MouseEvent} event
   */
  function laneUnder(event) {
    const y = event.clientY - element.getBoundingClientRect().top;
    const { lanes } = layout();
    const lane = lanes.length > 1 ? lanes.findIndex(({ top, bottom }) => y >= top && y < bottom) : -1;
    return lane < 0 ? null : lane;
  }

  function drawAll() {
    drawCells();
    drawCursor();
  }

  function drawCells() {
    const { clientWidth, clientHeight } = element;
    const context = prepare(cellCanvas, clientWidth, clientHeight, true);
    const { timeline, lanes, session, keyframeDoubts, annotation, otherCopy } = store.facts;
    if (!session) return;
    const style = getComputedStyle(element);
    const axis = frameAxis();
    const { lanes: bands, review, tasks, copy, overview } = layout();
    drawing.drawLabels(context, axis, style, bands, session.people, copy);
    if (annotation?.tasks.length) drawing.drawTasks(context, axis, statesByFrame(annotation.tasks), style, tasks);
    const earlier = earlierCalibration(store.facts);
    drawWithin(context, { left: axis.left, top: 0, right: axis.right + 2, bottom: overview.top }, () => {
      for (const [lane, band] of bands.entries()) {
        const cells = bands.length > 1 ? lanes[lane] : timeline;
        if (!cells) continue; // arrives shortly
        if (bands.length > 1) drawing.drawPerson(context, axis, cells, style, band, session.people[lane].color);
        else drawing.drawSources(context, axis, cells, style, band);
        if (earlier[lane]?.size) drawing.drawEarlier(context, axis, earlier[lane], style, band);
        drawing.drawKeyframes(context, axis, keyframesOf(cells), band);
        const doubted = keyframeDoubts.filter(({ person }) => bands.length === 1 || person === lane).map(({ frame }) => frame);
        drawing.drawDoubtedKeyframes(context, axis, doubted, style, band);
        drawing.drawAmbiguous(context, axis, framesWith(cells, AMBIGUOUS), band);
        const isKept = filterTest(store.facts, bands.length > 1 ? lane : null);
        if (isKept) drawDimmed(context, axis, isKept, style, band);
      }
      drawing.drawReviewed(context, axis, timeline, style, review);
      if (otherCopy && copy) drawCopy(context, axis, otherCopy, style, copy);
      drawing.drawStatuses(context, axis, timeline, style);
      drawing.drawCosts(context, axis, timeline, style);
    });
    drawing.drawOverview(context, whole(), timeline, style, overview);
  }

  function drawCursor() {
    const { clientWidth, clientHeight } = element;
    const context = prepare(cursor, clientWidth, clientHeight, true);
    const { session, target, range, visible } = store.facts;
    if (!session) return;
    const style = getComputedStyle(element);
    const axis = frameAxis();
    const { cells, overview } = layout();
    if (range) drawing.drawRange(context, axis, range, style, overview.top - 3);
    if (hovered !== null) {
      fillRect(context, style.getPropertyValue("--muted"), axis.middle(hovered) - 0.5, 0, 1, overview.top - REACH, 0.5);
    }
    drawing.drawWindow(context, whole(), visible, target, style, overview);
    if (!axis.shows(target)) return;
    const width = Math.max(2, axis.pitch);
    const [top, bottom] = [cells.top - 2, cells.bottom + 2];
    context.fillStyle = context.strokeStyle = style.getPropertyValue("--text");
    context.fillRect(axis.middle(target) - 0.5, 2, 1, top - 2);
    context.lineWidth = 2;
    context.strokeRect(axis.middle(target) - width / 2, top, width, bottom - top);
  }

  function describe() {
    const { target, session } = store.facts;
    element.setAttribute("aria-valuemax", String((session?.n_frames ?? 1) - 1));
    element.setAttribute("aria-valuenow", String(target));
    element.setAttribute("aria-valuetext", describeFrame(target, store.facts).join("\n"));
  }
}
