/**
 * Plot of best and tested costs by number of poses evaluated, with stages and other runs. A click replays that step.
 */

import { fillRect, prepare, setText } from "../widgets/canvas.js";
import { colorName, dashOf } from "../widgets/series_lines.js";
import { byId, make } from "../widgets/elements.js";
import { Plot, nearest } from "../widgets/plot.js";
import { selectedRun } from "../model/search_runs.js";
import { count } from "../widgets/text.js";

/** @typedef {import("../model/search_runs.js").Steps} Steps */

/** Quantile of the tested costs at the top of the plot, so that a few high ones do not flatten the rest. */
const SHOWN_SHARE = 0.95;
const NAME_GAP = 70;
const READOUT_HEIGHT = 18;

/**
 * @param {import("../model/store.js").Store} store
 * @param {(message: import("../model/protocol.js").ClientMessage) => void} send
 */
export function mountCostCurve(store, send) {
  const box = byId("cost-curve", HTMLElement);
  const lines = make("canvas", "is-layer");
  const read = make("output", "curve-readout");
  let hovered = /** @type {number | null} */ (null);
  let curvePlot = /** @type {Plot | null} */ (null);
  box.append(lines, read);
  new ResizeObserver(() => draw()).observe(box);
  store.onTab("search", ["searchSteps", "searchRuns", "searchRun"], draw);
  store.on(["theme"], () => draw());
  listen();

  function getRun() {
    return selectedRun(store.facts);
  }

  function getSteps() {
    return store.facts.searchSteps.get(getRun()?.number ?? -1) ?? null;
  }

  function listen() {
    const element = box;
    element.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      element.setPointerCapture(event.pointerId);
      goTo(event);
    });
    element.addEventListener("pointermove", (event) => {
      if (element.hasPointerCapture(event.pointerId)) goTo(event);
      hovered = stepUnder(event);
      requestAnimationFrame(() => draw());
    });
    element.addEventListener("pointerleave", () => {
      hovered = null;
      draw();
    });
  }

  /** @param {PointerEvent} event */
  function goTo(event) {
    const [run, step] = [getRun(), stepUnder(event)];
    if (run && step !== null && run.state !== "running") send({ type: "replay", run: run.number, step });
  }

  /**
   * @param {PointerEvent} event
   * @returns {number | null}
   */
  function stepUnder(event) {
    const steps = getSteps();
    if (!curvePlot || !steps || steps.count === 0) return null;
    return nearest(steps.evaluations, curvePlot.valueAt(event.clientX - box.getBoundingClientRect().left));
  }

  function draw() {
    const { clientWidth, clientHeight } = box;
    if (clientWidth === 0 || store.facts.drawer !== "search") return;
    const context = prepare(lines, clientWidth, clientHeight, true);
    const { searchRuns, searchSteps } = store.facts;
    const style = getComputedStyle(box);
    const runs = (searchRuns?.runs ?? []).filter(({ number }) => searchSteps.get(number)?.count);
    const [run, steps] = [getRun(), getSteps()];
    if (runs.length === 0) {
      curvePlot = null;
      read.textContent = "";
      setText(context, "center", "alphabetic", "12px");
      context.fillStyle = style.getPropertyValue("--muted");
      context.fillText("Start a search: Step, Stage or Frame", clientWidth / 2, clientHeight / 2);
      return;
    }
    const all = runs.map(({ number }) => /** @type {Steps} */ (searchSteps.get(number)));
    const evaluations = { min: 0, max: Math.max(...all.map((s) => s.evaluations[s.count - 1]), 1) };
    const plot = new Plot(clientWidth, clientHeight, evaluations, costs(all), READOUT_HEIGHT);
    curvePlot = plot;
    plot.drawFrame(context, style, "");
    plot.within(context, () => {
      if (run && steps) drawStages(context, plot, run, steps, style);
      runs.forEach((one, index) => {
        const of = all[index];
        const isSelected = one.number === run?.number;
        if (isSelected) drawTested(context, plot, of, style);
        context.strokeStyle = style.getPropertyValue(colorName(one.number - 1));
        context.globalAlpha = isSelected ? 1 : 0.6;
        context.lineWidth = isSelected ? 2 : 1.25;
        context.setLineDash(dashOf(one.number - 1));
        plot.drawLine(context, of.evaluations, of.best, true);
        context.setLineDash([]);
        context.globalAlpha = 1;
      });
    });
    if (run && steps) drawMarks(context, plot, run, steps, style);
  }

  /**
   * Draw the replayed step and the step under the pointer, and show its figures.
   *
   * @param {CanvasRenderingContext2D} context
   * @param {Plot} plot
   * @param {import("../model/protocol.js").SearchRun} run
   * @param {Steps} steps
   * @param {CSSStyleDeclaration} style
   */
  function drawMarks(context, plot, run, steps, style) {
    const replay = store.facts.searchRuns?.replay ?? null;
    const replayed = replay?.run === run.number ? Math.min(replay.step, steps.count - 1) : null;
    for (const [step, alpha] of /** @type {[number | null, number][]} */ ([[replayed, 1], [hovered, 0.5]])) {
      if (step === null || step < 0 || step >= steps.count) continue;
      fillRect(context, style.getPropertyValue("--text"), plot.x(steps.evaluations[step]) - 0.5, plot.top, 1, plot.bottom - plot.top, alpha);
    }
    const at = hovered ?? replayed ?? steps.count - 1;
    if (at < 0 || at >= steps.count) {
      read.textContent = "";
      return;
    }
    const stage = run.stages[steps.stages[at]];
    const where = stage ? `${stage.name} ×${stage.factor} · ` : "";
    const costs = `tested ${steps.tested[at].toFixed(2)} · best ${steps.best[at].toFixed(2)} px`;
    read.textContent = `${where}${count(steps.evaluations[at])} poses · ${costs}`;
  }
}

/**
 * @param {Steps[]} all
 * @returns {import("../widgets/plot.js").Range}
 */
function costs(all) {
  const tested = all.flatMap((steps) => [...steps.tested]).sort((a, b) => a - b);
  const min = Math.min(...all.map((steps) => steps.best[steps.count - 1]));
  const max = Math.max(tested[Math.floor(SHOWN_SHARE * (tested.length - 1))], ...all.map((steps) => steps.best[0]));
  const margin = Math.max(0.05, 0.06 * (max - min));
  return { min: Math.max(0, min - margin), max: max + margin };
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {Plot} plot
 * @param {Steps} steps
 * @param {CSSStyleDeclaration} style
 */
function drawTested(context, plot, steps, style) {
  context.fillStyle = style.getPropertyValue("--muted");
  for (let i = 0; i < steps.count; i += 1) {
    context.fillRect(plot.x(steps.evaluations[i]) - 1.5, plot.y(steps.tested[i]) - 1.5, 3, 3);
  }
}

/**
 * Draw the starts of stages, with their names where there is room.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {Plot} plot
 * @param {import("../model/protocol.js").SearchRun} run
 * @param {Steps} steps
 * @param {CSSStyleDeclaration} style
 */
function drawStages(context, plot, run, steps, style) {
  setText(context, "left", "top");
  let free = -Infinity;
  for (let i = 0; i < steps.count; i += 1) {
    if (i > 0 && steps.stages[i] === steps.stages[i - 1]) continue;
    const x = plot.x(i > 0 ? steps.evaluations[i - 1] : 0);
    fillRect(context, style.getPropertyValue("--faint"), x, plot.top, 1, plot.bottom - plot.top, 0.6);
    const stage = run.stages[steps.stages[i]];
    if (!stage || x < free) continue;
    const name = `${stage.name} ×${stage.factor}`;
    context.fillStyle = style.getPropertyValue("--muted");
    context.fillText(name, x + 4, plot.top + 2);
    free = x + Math.max(NAME_GAP, context.measureText(name).width + 10);
  }
}
