/** Curves of the angles over the frames, one group at a time. */

import { data } from "./data.js";
import { fillRect, setText } from "../widgets/canvas.js";
import { make } from "../widgets/elements.js";
import { begin, byId, token } from "./dom.js";
import { follow, redraw, seek, shown } from "./player.js";

const LEFT = 38;
const RIGHT = 8;
const MARGIN = 8;
/** Room for the numbers, and around the curves, px. */

const plots = data.people.flatMap((person) =>
  person.plots.map((plot) => ({ ...plot, name: data.people.length > 1 ? `${person.name}: ${plot.title}` : plot.title })),
);

const chosen = () => plots[Number(/** @type {HTMLSelectElement} */ (byId("plot")).value) || 0];

/**
 * Return the colour of a curve: four of the page, then the same dashed.
 *
 * @param {number} i
 */
const color = (i) => token(`--series-${i % 4}`);

const draw = () => {
  const begun = begin(byId("curves"));
  const plot = chosen();
  if (!begun || !plot) return;
  const { context, width, height } = begun;
  const values = plot.values.flat().filter((x) => x !== null);
  const [low, high] = values.length ? [Math.min(...values), Math.max(...values)] : [0, 1];
  const span = Math.max(high - low, 1);
  const x = (/** @type {number} */ i) => LEFT + ((width - LEFT - RIGHT) * i) / Math.max(1, data.frames.length - 1);
  const y = (/** @type {number} */ value) => height - MARGIN - ((height - 2 * MARGIN) * (value - low)) / span;
  fillRect(context, token("--plot"), LEFT, 0, width - LEFT - RIGHT, height);
  context.fillStyle = token("--muted");
  setText(context, "right", "alphabetic", "11px");
  for (const value of [low, high]) {
    context.fillText(`${value.toFixed(0)}${plot.unit === "deg" ? "°" : ` ${plot.unit}`}`, LEFT - 4, y(value) + 4);
  }
  plot.values.forEach((curve, i) => {
    context.beginPath();
    context.setLineDash(i < 4 ? [] : [4, 3]);
    let isDown = false;
    curve.forEach((value, k) => {
      if (value !== null && isDown) context.lineTo(x(k), y(value));
      else if (value !== null) context.moveTo(x(k), y(value));
      isDown = value !== null;
    });
    context.strokeStyle = color(i);
    context.lineWidth = 1.5;
    context.stroke();
  });
  context.setLineDash([]);
  fillRect(context, token("--accent"), x(shown().at) - 0.5, 0, 1.5, height);
  byId("legend").replaceChildren(
    ...plot.labels.map((label, i) => {
      const value = plot.values[i][shown().at];
      const line = { "--curve": color(i), "--dash": i < 4 ? "solid" : "dashed" };
      return make("li", line, value === null ? label : `${label} ${value.toFixed(0)}`);
    }),
  );
};

/** Make the curves and the choice of a group. */
export const mountCurves = () => {
  const select = byId("plot");
  select.append(...plots.map(({ name }, i) => new Option(name, String(i))));
  select.onchange = () => {
    select.blur(); // the keys play and step again
    redraw();
  };
  const canvas = byId("curves");
  canvas.onclick = (event) => {
    const share = (event.offsetX - LEFT) / (canvas.clientWidth - LEFT - RIGHT);
    seek(share * (data.frames.length - 1));
  };
  follow(draw);
};
