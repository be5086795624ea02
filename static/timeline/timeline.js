/**
 * Timeline: one cell per frame, coloured by source, with cost and status above and review marks below. A click or drag goes
 * to a frame; with Shift it marks a range. The strip at the bottom is an overview of the whole recording.
 */

import { make } from "../widgets/elements.js";
import { AMBIGUOUS, framesWith, keyframesOf } from "../model/cells.js";
import { filterTest } from "../model/provenance.js";
import { earlierCalibration } from "../model/selectors.js";
import { statesByFrame } from "../model/tasks.js";
import { prepare } from "../panes/drawing.js";
import { describeFrame } from "./cell_text.js";
import { drawCopy, drawDimmed } from "./cell_marks.js";
import { CellTip } from "./cell_tip.js";
import { FrameAxis } from "../widgets/frame_axis.js";
import { zoomByWheel } from "./frame_window.js";
import * as drawing from "./timeline_drawing.js";

/** Margin of the overview for the pointer. */
const REACH = 1;
const MIDDLE_BUTTON = 1;

/** @typedef {"scrub" | "mark" | "pan" | "overview"} Gesture of the pointer while it is down */

/** Facts that cells are drawn from and described by. @type {(keyof import("../model/store.js").Facts)[]} */
const CELL_FACTS = ["timeline", "lanes", "session", "keyframeDoubts", "calibration"];

export class Timeline {
  #element;
  #store;
  #navigation;
  #jumps;
  #frameWindow;
  #cells = make("canvas");
  #cursor = make("canvas");
  #tip;
  #hovered = /** @type {number | null} */ (null);
  #gesture = /** @type {Gesture | null} */ (null);
  /** Start of the range that is being marked. */
  #marked = 0;
  /** Position that stays under the pointer while panning. */
  #held = 0;

  /**
   * @param {HTMLElement} element
   * @param {{store: import("../model/store.js").Store, navigation: import("../model/navigation.js").Navigation,
   *   jumps: import("./jumps.js").Jumps, frameWindow: import("./frame_window.js").FrameWindow}} parts
   */
  constructor(element, { store, navigation, jumps, frameWindow }) {
    this.#element = element;
    this.#store = store;
    this.#navigation = navigation;
    this.#jumps = jumps;
    this.#frameWindow = frameWindow;
    element.append(this.#cells, this.#cursor);
    this.#tip = new CellTip(element);
    store.on(["session", "annotation", "otherCopy"], () => (element.style.height = `${this.#layout.height}px`));
    store.on([...CELL_FACTS, "visible", "annotation", "otherCopy", "provenanceFilter", "annotators"], () => this.#drawCells());
    store.on(["target", "session", "range", "visible", "annotation"], () => this.#drawCursor());
    store.on([...CELL_FACTS, "target"], () => this.#describe());
    new ResizeObserver(() => this.#drawAll()).observe(element);
    store.on(["theme"], () => this.#drawAll());
    this.#listen();
  }

  get #layout() {
    const { session, annotation, otherCopy } = this.#store.facts;
    return drawing.layout(session?.people.length ?? 1, !!annotation?.tasks.length, otherCopy !== null);
  }

  get #axis() {
    return new FrameAxis(this.#element.clientWidth, this.#store.facts.session?.n_frames ?? 1, this.#store.facts.visible);
  }

  /** Axis of the overview. */
  get #whole() {
    return new FrameAxis(this.#element.clientWidth, this.#store.facts.session?.n_frames ?? 1, null);
  }

  #listen() {
    const element = this.#element;
    element.addEventListener("pointerdown", (event) => this.#press(event));
    element.addEventListener("pointermove", (event) => {
      if (this.#gesture) this.#drag(event);
      const frame = this.#isOverview(event) ? null : this.#axis.frameUnder(event, element);
      const lane = this.#laneUnder(event);
      if (frame === null || this.#gesture) this.#tip.hide();
      else this.#tip.show(describeFrame(frame, this.#store.facts, lane), event.clientX);
      element.title = frame === null ? "Overview of the recording: drag to move the visible part" : "";
      if (frame === this.#hovered) return;
      this.#hovered = frame;
      requestAnimationFrame(() => this.#drawCursor());
    });
    for (const end of /** @type {const} */ (["pointerup", "pointercancel"])) {
      element.addEventListener(end, () => {
        this.#gesture = null;
        element.classList.remove("is-panning");
      });
    }
    element.addEventListener("pointerleave", () => {
      this.#hovered = null;
      this.#tip.hide();
      requestAnimationFrame(() => this.#drawCursor());
    });
    element.addEventListener("dblclick", (event) => {
      if (this.#isOverview(event)) this.#frameWindow.zoom(0, 0);
      else this.#store.set({ range: this.#jumps.intervalAround(this.#axis.frameUnder(event, element)) });
    });
    zoomByWheel(element, this.#frameWindow, () => this.#axis);
    element.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: -1, ArrowRight: 1, PageDown: -10, PageUp: 10 }[event.key];
      if (step === undefined || event.ctrlKey || event.altKey || event.metaKey) return;
      event.preventDefault();
      this.#navigation.step(step);
    });
  }

  /** @param {PointerEvent} event */
  #press(event) {
    const element = this.#element;
    if (event.button !== 0 && event.button !== MIDDLE_BUTTON) return;
    event.preventDefault();
    element.setPointerCapture(event.pointerId);
    const frame = this.#axis.frameUnder(event, element);
    if (event.button === MIDDLE_BUTTON) {
      this.#gesture = "pan";
      this.#held = this.#placeUnder(event);
      element.classList.add("is-panning");
    } else if (this.#store.facts.visible && this.#isOverview(event)) {
      this.#gesture = "overview";
      this.#drag(event);
    } else if (event.shiftKey) {
      this.#gesture = "mark";
      this.#marked = frame;
      this.#store.set({ range: null });
    } else {
      this.#gesture = "scrub";
      this.#navigation.pause();
      this.#navigation.goTo(frame);
    }
  }

  /** @param {PointerEvent} event */
  #drag(event) {
    const frame = this.#axis.frameUnder(event, this.#element);
    if (this.#gesture === "scrub") this.#navigation.goTo(frame);
    else if (this.#gesture === "pan") this.#frameWindow.move(this.#held - this.#placeUnder(event));
    else if (this.#gesture === "overview") this.#frameWindow.centre(this.#whole.placeAt(this.#x(event)));
    else if (frame !== this.#marked || this.#store.facts.range) {
      this.#store.set({ range: { first: Math.min(frame, this.#marked), last: Math.max(frame, this.#marked) } });
    }
  }

  /** @param {MouseEvent} event */
  #x(event) {
    return event.clientX - this.#element.getBoundingClientRect().left;
  }

  /** @param {MouseEvent} event */
  #placeUnder(event) {
    return this.#axis.placeAt(this.#x(event));
  }

  /** @param {MouseEvent} event */
  #isOverview(event) {
    return event.clientY - this.#element.getBoundingClientRect().top >= this.#layout.overview.top - REACH;
  }

  /**
   * Index of the person whose lane is under the pointer; null beside the lanes, and where there is only one person.
   *
   * @param {MouseEvent} event
   */
  #laneUnder(event) {
    const y = event.clientY - this.#element.getBoundingClientRect().top;
    const { lanes } = this.#layout;
    const lane = lanes.length > 1 ? lanes.findIndex(({ top, bottom }) => y >= top && y < bottom) : -1;
    return lane < 0 ? null : lane;
  }

  #drawAll() {
    this.#drawCells();
    this.#drawCursor();
  }

  #drawCells() {
    const { clientWidth, clientHeight } = this.#element;
    const context = prepare(this.#cells, clientWidth, clientHeight, true);
    const { timeline, lanes, session, keyframeDoubts, annotation, otherCopy } = this.#store.facts;
    if (!session) return;
    const style = getComputedStyle(this.#element);
    const axis = this.#axis;
    const { lanes: bands, review, tasks, copy, overview } = this.#layout;
    drawing.drawLabels(context, axis, style, bands, session.people, copy);
    if (annotation?.tasks.length) drawing.drawTasks(context, axis, statesByFrame(annotation.tasks), style, tasks);
    context.save();
    context.beginPath();
    context.rect(axis.left, 0, axis.right - axis.left + 2, overview.top);
    context.clip();
    const earlier = earlierCalibration(this.#store.facts);
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
      const isKept = filterTest(this.#store.facts, bands.length > 1 ? lane : null);
      if (isKept) drawDimmed(context, axis, isKept, style, band);
    }
    drawing.drawReviewed(context, axis, timeline, style, review);
    if (otherCopy && copy) drawCopy(context, axis, otherCopy, style, copy);
    drawing.drawStatuses(context, axis, timeline, style);
    drawing.drawCosts(context, axis, timeline, style);
    context.restore();
    drawing.drawOverview(context, this.#whole, timeline, style, overview);
  }

  #drawCursor() {
    const { clientWidth, clientHeight } = this.#element;
    const context = prepare(this.#cursor, clientWidth, clientHeight, true);
    const { session, target, range, visible } = this.#store.facts;
    if (!session) return;
    const style = getComputedStyle(this.#element);
    const axis = this.#axis;
    const { cells, overview } = this.#layout;
    if (range) drawing.drawRange(context, axis, range, style, overview.top - 3);
    if (this.#hovered !== null) {
      context.fillStyle = style.getPropertyValue("--muted");
      context.globalAlpha = 0.5;
      context.fillRect(axis.middle(this.#hovered) - 0.5, 0, 1, overview.top - REACH);
      context.globalAlpha = 1;
    }
    drawing.drawWindow(context, this.#whole, visible, target, style, overview);
    if (!axis.shows(target)) return;
    const width = Math.max(2, axis.pitch);
    const [top, bottom] = [cells.top - 2, cells.bottom + 2];
    context.fillStyle = context.strokeStyle = style.getPropertyValue("--text");
    context.fillRect(axis.middle(target) - 0.5, 2, 1, top - 2);
    context.lineWidth = 2;
    context.strokeRect(axis.middle(target) - width / 2, top, width, bottom - top);
  }

  #describe() {
    const { target, session } = this.#store.facts;
    this.#element.setAttribute("aria-valuemax", String((session?.n_frames ?? 1) - 1));
    this.#element.setAttribute("aria-valuenow", String(target));
    this.#element.setAttribute("aria-valuetext", describeFrame(target, this.#store.facts).join("\n"));
  }
}
