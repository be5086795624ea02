/** Borders between the panes, moved by pointer or arrow keys. A corner moves all borders that meet there. */

import { make } from "../widgets/elements.js";
import { makeSeparator, onDrag, showPosition } from "../widgets/separator.js";

/**
 * @typedef {import("./grid_layout.js").Border} Border
 * @typedef {import("./grid_layout.js").Box} Box
 */

/** Width of the area that takes the pointer. */
const REACH_PX = 8;
const HOW = "Drag to resize, double-click to reset";
const CORNER_PX = 14;
/** Borders of neighbouring tracks that are this close move together at their corner. */
const ALIGNED_PX = 6;

/**
 * @param {HTMLElement} grid
 * @param {(border: Border, size: number | null) => void} move gives the neighbour before a border a size; null for the
 *   automatic sizes of all neighbours in line
 */
export function makePaneBorders(grid, move) {
  /** @type {Map<string, {bar: HTMLElement, border: Border}>} */
  const bars = new Map();
  /** @type {{element: HTMLElement, borders: Border[]}[]} */
  const cornerList = [];

  /**
   * @param {Border[]} borders
   * @param {boolean} isColumns whether the tracks are columns
   * @param {string[][]} names of the cameras in each track
   */
  function show(borders, isColumns, names) {
    const keys = new Set(borders.map(keyOf));
    for (const [key, { bar }] of bars) {
      if (keys.has(key)) continue;
      bar.remove();
      bars.delete(key);
    }
    for (const border of borders) {
      const bar = barOf(border);
      place(bar, grown(border.box, border.isVertical));
      const { of, index, sizes, min } = border;
      const track = isColumns ? "column" : "row";
      const between = of === "tracks" ? `${track} ${index + 1} and ${track} ${index + 2}` : names[of].slice(index, index + 2).join(" and ");
      bar.setAttribute("aria-label", `Border between ${between}`);
      const both = (sizes[index] + sizes[index + 1]) / 100;
      showPosition(bar, { now: sizes[index] / both, min: min / both, max: 100 - min / both });
    }
    showCorners(cornersOf(borders));
  }

  /** @param {Border} border */
  function barOf(border) {
    const known = bars.get(keyOf(border));
    if (known) {
      known.border = border;
      grid.append(...(known.bar.isConnected ? [] : [known.bar]));
      return known.bar;
    }
    const orientation = border.isVertical ? "vertical" : "horizontal";
    const bar = make("div", { className: "pane-border", role: "separator", tabIndex: 0, title: HOW, "aria-orientation": orientation });
    const shown = { bar, border };
    bars.set(keyOf(border), shown);
    makeSeparator(bar, {
      position: () => shown.border.sizes[shown.border.index],
      moveTo: (size) => move(shown.border, size),
      reset: () => move(shown.border, null),
    });
    grid.append(bar);
    return bar;
  }

  /** @param {{x: number, y: number, borders: Border[]}[]} corners */
  function showCorners(corners) {
    while (cornerList.length > corners.length) cornerList.pop()?.element.remove();
    while (cornerList.length < corners.length) cornerList.push(newCorner());
    corners.forEach(({ x, y, borders }, index) => {
      const corner = cornerList[index];
      corner.borders = borders;
      if (!corner.element.isConnected) grid.append(corner.element);
      place(corner.element, { x: x - CORNER_PX / 2, y: y - CORNER_PX / 2, width: CORNER_PX, height: CORNER_PX });
    });
  }

  /** By keys, each border is moved by itself. */
  function newCorner() {
    const element = make("div", { className: "pane-corner", title: HOW, "aria-hidden": "true" });
    const corner = { element, borders: /** @type {Border[]} */ ([]) };
    onDrag(element, () => {
      const moved = corner.borders;
      return (dx, dy) => moved.forEach((border) => move(border, border.sizes[border.index] + (border.isVertical ? dx : dy)));
    });
    element.addEventListener("dblclick", () => corner.borders.forEach((border) => move(border, null)));
    return corner;
  }

  return { show };
}

/** @param {Border} border */
function keyOf({ of, index, isVertical }) {
  return `${of} ${index} ${isVertical}`;
}

/**
 * Places where a border between panes meets one between tracks, with all borders there.
 *
 * @param {Border[]} borders
 */
function cornersOf(borders) {
  /** @type {{x: number, y: number, borders: Border[]}[]} */
  const corners = [];
  for (const between of borders.filter(({ of }) => of === "tracks")) {
    const beside = borders.filter(({ of }) => of === between.index || of === between.index + 1);
    for (const border of beside) {
      const [upright, level] = border.isVertical ? [border, between] : [between, border];
      const at = { x: upright.box.x + upright.box.width / 2, y: level.box.y + level.box.height / 2 };
      const same = corners.find(({ x, y, borders: [first] }) => first === between && Math.hypot(x - at.x, y - at.y) <= ALIGNED_PX);
      if (same) same.borders.push(border);
      else corners.push({ ...at, borders: [between, border] });
    }
  }
  return corners;
}

/**
 * Area around a gap that takes the pointer.
 *
 * @param {Box} gap
 * @param {boolean} isVertical
 * @returns {Box}
 */
function grown({ x, y, width, height }, isVertical) {
  return isVertical
    ? { x: x + (width - REACH_PX) / 2, y, width: REACH_PX, height }
    : { x, y: y + (height - REACH_PX) / 2, width, height: REACH_PX };
}

/**
 * @param {HTMLElement} element
 * @param {Box} box
 */
function place(element, { x, y, width, height }) {
  Object.assign(element.style, { left: `${x}px`, top: `${y}px`, width: `${width}px`, height: `${height}px` });
}
