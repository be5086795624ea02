/** Picture of the cost over two degrees of freedom around the shown pose. A click or Enter takes the pose there. */

import { fillRect, prepare } from "../widgets/canvas.js";
import { make, textButton } from "../widgets/elements.js";
import { ARROWS } from "../widgets/key_matching.js";
import { nearest } from "../widgets/plot.js";
import { displayName } from "../widgets/text.js";

/**
 * @typedef {import("../model/protocol.js").CostMapMessage} CostMap
 * @typedef {{column: number, row: number}} Place
 */

const HEIGHT_PX = 190;
/** Poses up to so many nats above the best have a line around them: they are about as good. */
const NEAR_NATS = 6;
const UNITS = { deg: "°", cm: " cm" };

/**
 * @param {import("../model/index.js").Context} context
 * @param {import("../posing/posing.js").Posing} posing
 */
export function costMap({ store, send }, posing) {
  const element = make("div", "cost-map");
  const open = textButton("Cost over two angles", "Show the cost around this pose over two angles of the joint, in nats", () => toggle(true));
  const close = textButton("Hide", "Hide the cost over two angles", () => toggle(false));
  const [across, up] = ["Horizontal angle", "Vertical angle"].map((label) => axisChoice(label, () => ask()));
  const canvas = make("canvas", { tabIndex: 0, role: "application" });
  const read = make("output", "section-note");
  const axes = make("div", "cost-map-axes", across, "×", up, close);
  element.append(open, axes, canvas, read);
  let isOpen = false;
  let isAsking = false;
  let listed = "";
  /** @type {Place | null} the place under the pointer, or that the keys moved to */
  let cursor = null;
  /** Whether keys moved it there; they begin at the pose. */
  let isByKeys = false;

  const dofs = () => /** @type {[number, number]} */ ([Number(across.value), Number(up.value)]);
  /** The map of the chosen angles; null while it is not known. */
  const shown = () => {
    const { costMap: found, state } = store.facts;
    return isOpen && found && found.person === state?.person && found.dofs.join() === dofs().join() ? found : null;
  };
  const ask = () => {
    const { state, connected } = store.facts;
    if (!isOpen || !state || !connected || across.value === up.value) return leave();
    isAsking = true;
    send({ type: "cost_map", person: state.person, dofs: dofs() });
    draw();
  };
  const leave = () => {
    if (isAsking && store.facts.connected) send({ type: "cost_map", person: store.facts.state?.person ?? 0, dofs: null });
    isAsking = false;
  };
  /** @param {boolean} opens */
  const toggle = (opens) => {
    isOpen = opens;
    update(true);
    if (opens) canvas.focus();
    else leave();
  };
  /** @param {Place} place */
  const take = ({ column, row }) => {
    const found = shown();
    if (found) send({ type: "cost_map_set", person: found.person, dofs: found.dofs, values: [found.across[column], found.up[row]] });
  };
  const draw = () => {
    const found = shown();
    const { person } = posing.joint();
    const width = canvas.parentElement?.clientWidth ?? 0;
    if (!isOpen || width === 0) return;
    canvas.style.height = `${HEIGHT_PX}px`;
    const context = prepare(canvas, width, HEIGHT_PX, true);
    if (found) drawMap(context, found, width, cursor, getComputedStyle(canvas));
    read.textContent = found && person ? describe(found, cursor, person) : "Sampling the cost…";
  };
  canvas.addEventListener("pointermove", ({ offsetX, offsetY }) => {
    const found = shown();
    if (!found) return;
    cursor = placeAt(found, offsetX / canvas.clientWidth, offsetY / HEIGHT_PX);
    isByKeys = false;
    draw();
  });
  canvas.addEventListener("pointerleave", () => {
    cursor = null;
    draw();
  });
  canvas.addEventListener("click", () => cursor && take(cursor));
  canvas.addEventListener("keydown", (event) => {
    const [found, step] = [shown(), ARROWS.get(event.key)];
    if (!found || event.altKey || event.ctrlKey || event.metaKey || !(step || event.key === "Enter")) return;
    event.preventDefault();
    event.stopPropagation(); // arrows move joints elsewhere
    const from = isByKeys && cursor ? cursor : currentPlace(found);
    cursor = step ? moved(found, from, step) : from;
    isByKeys = step !== undefined;
    if (!step) take(cursor);
    draw();
  });

  /** @param {boolean} [isChosen] whether the angles may have changed */
  const update = (isChosen = false) => {
    const { person, limb, dofs: own } = posing.joint();
    // A joint of one angle is shown with those of its limb.
    const offered = own.length > 1 ? own : [...new Set([...own, ...limb.dofs])];
    open.hidden = isOpen || own.length === 0 || offered.length < 2;
    axes.hidden = canvas.hidden = read.hidden = !isOpen || own.length === 0 || offered.length < 2;
    const described = JSON.stringify([store.facts.state?.person, offered]);
    if (described !== listed && person) {
      listed = described;
      cursor = null;
      for (const choice of [across, up]) {
        choice.replaceChildren(...offered.map((dof) => new Option(nameOf(person.dofs[dof], own.length > 1), String(dof))));
      }
      across.value = String(offered[0]);
      up.value = String(offered[1]);
      isChosen = true;
    }
    if (isChosen) ask();
    draw();
  };
  new ResizeObserver(() => {
    const isSeen = element.getClientRects().length > 0;
    if (isSeen && !isAsking) ask();
    else if (!isSeen) leave();
    draw();
  }).observe(element);
  return { element, update, open: () => toggle(true) };
}

/**
 * @param {import("../model/protocol.js").DofInfo} info
 * @param {boolean} isOfJoint whether all are of the selected joint
 */
function nameOf({ joint, name }, isOfJoint) {
  return isOfJoint ? name : `${displayName(joint).replace(/^(left|right) /, "")} ${name}`;
}

/**
 * @param {string} label
 * @param {() => void} change
 */
function axisChoice(label, change) {
  return make("select", { title: label, "aria-label": label, onchange: change });
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {CostMap} map
 * @param {number} width
 * @param {Place | null} cursor
 * @param {CSSStyleDeclaration} style
 */
function drawMap(context, map, width, cursor, style) {
  const { across, up, nats } = map;
  const [w, h] = [width / across.length, HEIGHT_PX / up.length];
  const best = Math.min(...nats.flat());
  fillRect(context, style.getPropertyValue("--plot"), 0, 0, width, HEIGHT_PX);
  const color = style.getPropertyValue("--accent");
  const range = Math.max(NEAR_NATS, Math.max(...nats.flat()) - best);
  nats.forEach((costs, row) =>
    costs.forEach((cost, column) => {
      // Whole pixels: seams would look like a grid.
      const [left, right] = [column * w, (column + 1) * w].map(Math.round);
      const [top, bottom] = [HEIGHT_PX - (row + 1) * h, HEIGHT_PX - row * h].map(Math.round);
      fillRect(context, color, left, top, right - left, bottom - top, 0.85 * (1 - Math.sqrt((cost - best) / range)));
    }),
  );
  context.strokeStyle = style.getPropertyValue("--text");
  context.lineWidth = 1.25;
  context.stroke(outline(nats, best + NEAR_NATS, w, h));
  mark(context, place(map, currentPlace(map), w, h), "cross");
  if (cursor) mark(context, place(map, cursor, w, h), "ring");
}

/**
 * Borders between samples on either side of a cost.
 *
 * @param {number[][]} nats
 * @param {number} limit
 * @param {number} w
 * @param {number} h
 */
function outline(nats, limit, w, h) {
  const lines = new Path2D();
  const isIn = (/** @type {number} */ row, /** @type {number} */ column) => (nats[row]?.[column] ?? Infinity) <= limit;
  nats.forEach((costs, row) =>
    costs.forEach((_, column) => {
      const [x, y] = [column * w, HEIGHT_PX - row * h];
      if (isIn(row, column) !== isIn(row, column - 1) && column > 0) lines.moveTo(x, y), lines.lineTo(x, y - h);
      if (isIn(row, column) !== isIn(row - 1, column) && row > 0) lines.moveTo(x, y), lines.lineTo(x + w, y);
    }),
  );
  return lines;
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {{x: number, y: number}} at
 * @param {"cross" | "ring"} kind
 */
function mark(context, { x, y }, kind) {
  context.beginPath();
  if (kind === "ring") context.arc(x, y, 5, 0, 2 * Math.PI);
  else for (const [dx, dy] of [[6, 0], [0, 6]]) context.moveTo(x - dx, y - dy), context.lineTo(x + dx, y + dy); // prettier-ignore
  context.stroke();
}

/**
 * @param {CostMap} map
 * @param {Place} at
 * @param {number} w
 * @param {number} h
 */
function place({ up }, { column, row }, w, h) {
  return { x: (column + 0.5) * w, y: (up.length - row - 0.5) * h };
}

/**
 * @param {CostMap} map
 * @param {number} x share of the width
 * @param {number} y share of the height
 * @returns {Place}
 */
function placeAt({ across, up }, x, y) {
  const within = (/** @type {number} */ at, /** @type {number} */ count) => Math.max(0, Math.min(count - 1, Math.floor(at * count)));
  return { column: within(x, across.length), row: up.length - 1 - within(y, up.length) };
}

/**
 * The sample nearest to the pose.
 *
 * @param {CostMap} map
 * @returns {Place}
 */
function currentPlace({ across, up, current }) {
  return { column: nearest(across, current[0]), row: nearest(up, current[1]) };
}

/**
 * @param {CostMap} map
 * @param {Place} from
 * @param {number[]} step
 * @returns {Place}
 */
function moved({ across, up }, { column, row }, [right, above]) {
  const within = (/** @type {number} */ at, /** @type {number} */ count) => Math.max(0, Math.min(count - 1, at));
  return { column: within(column + right, across.length), row: within(row + above, up.length) };
}

/**
 * The place under the cursor in words, or else the best place.
 *
 * @param {CostMap} map
 * @param {Place | null} cursor
 * @param {import("../model/protocol.js").PersonInfo} person
 */
function describe({ dofs, across, up, nats }, cursor, person) {
  const flat = nats.flat();
  const best = flat.indexOf(Math.min(...flat));
  const { column, row } = cursor ?? { column: best % across.length, row: Math.floor(best / across.length) };
  const values = [across[column], up[row]].map((value, i) => `${person.dofs[dofs[i]].name} ${value.toFixed(0)}${UNITS[person.dofs[dofs[i]].unit]}`);
  const cost = nats[row][column];
  const against = Math.abs(cost) < 0.5 ? "as this pose" : `${Math.abs(cost).toFixed(0)} nats ${cost < 0 ? "better" : "worse"}`;
  return `${cursor ? "" : "Best: "}${values.join(", ")}: ${against}${cursor ? "" : ". Click or Enter takes a place"}`;
}
