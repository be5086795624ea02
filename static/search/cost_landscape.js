/** Plot of the cost over the range of one degree of freedom. Hovering reads values, a click sets the value. */

import { circlePath, fillRect, prepare, setText } from "../widgets/canvas.js";
import { colorName, dashOf, lineSwatch } from "../widgets/series_lines.js";
import { byId, make, onChange, textButton } from "../widgets/elements.js";
import { Plot, nearest } from "../widgets/plot.js";
import { displayName } from "../widgets/text.js";

/** @typedef {import("../model/search_runs.js").Landscape} Landscape */

const UNITS = { rad: { factor: 180 / Math.PI, sign: "°" }, m: { factor: 100, sign: " cm" } };

/**
 * @param {import("../model/store.js").Store} store
 * @param {(message: import("../model/protocol.js").ClientMessage) => void} send
 */
export function mountCostLandscape(store, send) {
  const element = byId("landscape", HTMLElement);
  const controls = byId("landscape-controls", HTMLElement);
  const canvas = make("canvas", "is-layer");
  const choice = make("select", { title: "Degree of freedom to vary; all others stay fixed", "aria-label": "Degree of freedom" });
  const legend = make("div", "landscape-legend");
  /** Text shown until there is a landscape. */
  const waiting = make("p", "landscape-waiting");
  let hovered = /** @type {number | null} */ (null);
  let lastPlot = /** @type {Plot | null} */ (null);
  /** The names that the list of degrees of freedom was built for. */
  let listed = "";
  onChange(choice, () => send({ type: "landscape", dof: choice.value }));
  const toMinimum = textButton("To minimum", "Set this degree of freedom to the minimum of the cost", () => {
    const found = store.facts.landscape;
    if (found) setTo(found.values[indexOfMin(found.total)]);
  });
  controls.append(choice, toMinimum, legend);
  element.append(canvas, waiting);
  store.onTab("landscape", ["dof", "connected"], followSelection);
  store.onTab("landscape", ["landscape", "session"], show);
  new ResizeObserver(() => draw()).observe(element);
  store.on(["theme"], show);
  listen();

  /** Show the degree of freedom that the keys change, if a joint is selected. */
  function followSelection() {
    const { state, session, dof, connected } = store.facts;
    const info = state?.point && dof !== null ? session?.people[state.person].dofs[dof] : undefined;
    if (info && connected) send({ type: "landscape", dof: `${info.joint}.${info.name}` });
  }

  function listen() {
    element.addEventListener("pointermove", (event) => {
      const found = store.facts.landscape;
      if (!found || !lastPlot) return;
      const value = lastPlot.valueAt(event.clientX - element.getBoundingClientRect().left) / UNITS[found.unit].factor;
      hovered = nearest(found.values, value);
      requestAnimationFrame(() => draw());
    });
    element.addEventListener("pointerleave", () => {
      hovered = null;
      draw();
    });
    element.addEventListener("click", () => {
      const found = store.facts.landscape;
      if (found && hovered !== null) setTo(found.values[hovered]);
    });
  }

  /** @param {number} value rad or metres */
  function setTo(value) {
    const found = store.facts.landscape;
    if (found) send({ type: "landscape_set", person: found.person, dof: found.dof, value });
  }

  function show() {
    const { landscape: found, session, state } = store.facts;
    toMinimum.disabled = choice.disabled = !found;
    waiting.hidden = Boolean(found);
    waiting.textContent = state?.compiling
      ? "The cost is sampled once the kernels are compiled."
      : "Sampling the cost along one degree of freedom…";
    if (found && found.names.join() !== listed) {
      listed = found.names.join();
      const groups = new Map(found.names.map((name) => [name.split(".")[0], make("optgroup")]));
      for (const [joint, group] of groups) group.label = displayName(joint);
      for (const name of found.names) groups.get(name.split(".")[0])?.append(new Option(displayName(name).replace(".", " "), name));
      choice.replaceChildren(...groups.values());
    }
    if (found) {
      choice.value = found.names[found.dof];
      const labels = ["mean", ...(session?.cameras.map(({ name }) => name) ?? [])];
      legend.replaceChildren(...["", ...labels].map((label, index) => legendEntry(label, index - 1)));
    }
    draw();
  }

  function draw() {
    const { clientWidth, clientHeight } = element;
    if (clientWidth === 0 || store.facts.drawer !== "landscape") return;
    const context = prepare(canvas, clientWidth, clientHeight, true);
    const found = store.facts.landscape;
    if (!found) return;
    const { factor, sign } = UNITS[found.unit];
    const style = getComputedStyle(element);
    const curves = [found.total, ...found.views];
    const known = curves.flatMap((curve) => [...curve].filter(Number.isFinite));
    const [min, max] = [Math.min(...known, found.current_px ?? Infinity), Math.max(...known)];
    const margin = Math.max(0.05, 0.06 * (max - min));
    const xs = found.values.map((value) => value * factor);
    const range = { min: xs[0], max: xs[xs.length - 1] };
    const plot = new Plot(clientWidth, clientHeight, range, { min: Math.max(0, min - margin), max: max + margin });
    lastPlot = plot;
    plot.drawFrame(context, style, sign);
    plot.within(context, () => {
      curves.slice(1).forEach((curve, view) => {
        context.strokeStyle = style.getPropertyValue(colorName(view + 1));
        context.setLineDash(dashOf(view + 1));
        context.lineWidth = 1.25;
        plot.drawLine(context, xs, curve);
      });
      context.setLineDash([]);
      context.strokeStyle = style.getPropertyValue(colorName(0));
      context.lineWidth = 2.25;
      plot.drawLine(context, xs, found.total);
    });
    drawMarks(context, plot, found, factor, style);
    readOut(found, hovered, factor, sign);
  }

  /**
   * Draw the current value, the minimum and the value under the pointer.
   *
   * @param {CanvasRenderingContext2D} context
   * @param {Plot} plot
   * @param {Landscape} found
   * @param {number} factor
   * @param {CSSStyleDeclaration} style
   */
  function drawMarks(context, plot, found, factor, style) {
    const height = plot.bottom - plot.top;
    const now = plot.x(found.current * factor);
    context.fillStyle = context.strokeStyle = style.getPropertyValue("--text");
    context.fillRect(now - 0.5, plot.top, 1, height);
    const isRight = now > (plot.left + plot.right) / 2;
    setText(context, isRight ? "right" : "left", "top", "600 10.5px");
    context.fillText("now", now + (isRight ? -4 : 4), plot.top + 2);
    const min = indexOfMin(found.total);
    const [x, y] = [plot.x(found.values[min] * factor), plot.y(found.total[min])];
    context.lineWidth = 2;
    context.stroke(circlePath(x, y, 4.5));
    if (hovered !== null) {
      fillRect(context, style.getPropertyValue("--text"), plot.x(found.values[hovered] * factor) - 0.5, plot.top, 1, height, 0.5);
    }
  }

  /**
   * @param {Landscape} found
   * @param {number | null} hovered
   * @param {number} factor
   * @param {string} sign
   */
  function readOut(found, hovered, factor, sign) {
    const min = indexOfMin(found.total);
    const at = hovered ?? nearest(found.values, found.current);
    const value = hovered === null ? found.current : found.values[at];
    const outputs = legend.querySelectorAll("output");
    const costs = [found.total, ...found.views].map((curve) => (Number.isFinite(curve[at]) ? curve[at].toFixed(2) : "–"));
    const texts = [`${(value * factor).toFixed(1)}${sign}`, ...costs];
    outputs.forEach((output, index) => (output.textContent = texts[index] ?? ""));
    const best = `${(found.values[min] * factor).toFixed(1)}${sign}`;
    toMinimum.title = `Set it to ${best}, the minimum of the mean cost (${found.total[min].toFixed(2)} px). Can be undone`;
    element.title = hovered === null ? "" : "Click to set the value";
  }
}

/**
 * @param {string} label empty for the value of the degree of freedom
 * @param {number} index of the curve
 */
function legendEntry(label, index) {
  const ofCurve = index === 0 ? "Mean of all views, px" : `Cost in ${label}, px`;
  const title = label ? ofCurve : "Value under the pointer, or of the current pose";
  return make("span", { title }, ...(label ? [lineSwatch(index), label] : []), make("output"));
}

/** @param {Float32Array} costs */
function indexOfMin(costs) {
  return costs.reduce((best, cost, index) => (cost < costs[best] ? index : best), 0);
}
