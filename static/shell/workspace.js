/** Widths of the camera panes and the 3-D view beside them. The place of their separator is stored. */

import { makeSeparator, showPosition } from "../widgets/separator.js";

const STORED = "quadrille.panes-fraction";
const DEFAULT_FRACTION = 0.62;
const MIN_PANES_PX = 480;
const MIN_SCENE_PX = 300;

/**
 * @param {HTMLElement} workspace
 * @param {HTMLElement} bar
 * @param {HTMLElement} column beside the 3-D view, whose width is taken from the 3-D view first
 */
export function divideWorkspace(workspace, bar, column) {
  let fraction = Number(localStorage.getItem(STORED)) || DEFAULT_FRACTION;

  const show = () => {
    const width = workspace.clientWidth;
    const max = width - column.offsetWidth - MIN_SCENE_PX;
    const panes = Math.round(Math.max(Math.min(MIN_PANES_PX, max), Math.min(max, fraction * width)));
    workspace.style.setProperty("--panes-width", `${panes}px`);
    const share = 100 / Math.max(1, width);
    showPosition(bar, { now: share * panes, min: share * Math.min(MIN_PANES_PX, max), max: share * max });
    return panes;
  };
  const moveTo = (/** @type {number} */ x) => {
    fraction = x / workspace.clientWidth;
    fraction = show() / workspace.clientWidth;
    localStorage.setItem(STORED, String(fraction));
  };

  makeSeparator(bar, { position: show, moveTo, reset: () => moveTo(DEFAULT_FRACTION * workspace.clientWidth) });
  const sizes = new ResizeObserver(show);
  sizes.observe(workspace);
  sizes.observe(column);
}
