/** Table of parts by views. Arrow keys move among its cells, Enter or a click zooms the view to the part. */

import { make, tableRow } from "../widgets/elements.js";
import { ARROWS } from "../widgets/key_matching.js";
import { displayName } from "../widgets/text.js";

/**
 * @typedef {import("../model/protocol.js").ReasonMessage} ReasonMessage
 * @typedef {import("../model/protocol.js").PartReason} PartReason
 * @typedef {import("../model/protocol.js").CameraInfo} CameraInfo
 * @typedef {{camera: number, person: number, part: number}} PartCell
 *
 * @typedef {object} Measure
 * @property {string} id
 * @property {string} label
 * @property {string} title
 * @property {(part: PartReason, view: number) => string} text of a cell; empty where the view does not show it
 * @property {(part: PartReason, view: number, camera: CameraInfo) => number} level how unusual it is: 0 to 3
 */

/** Evidence below the usual from which a cell is marked, nats: clearly worse, worth another pose, and twice that. */
const NATS = [3, 6, 12];
/** The same for the share outside the silhouette above the usual. */
const OUTSIDE = [0.1, 0.25, 0.5];
/** The same for the contour, in outlier distances above the usual. */
const CONTOUR = [0.1, 0.25, 0.5];
/** Outlier distance as a share of the longer side of the image, as in `tracker/evidence/view_evidence.py`. */
const OUTLIER_SHARE = 0.03;

/** @type {Measure[]} */
export const MEASURES = [
  {
    id: "colors",
    label: "Colours",
    title: "Evidence of the part's colours against the usual of this run, nats: −6 is 400 times less likely",
    text: ({ below_nats }, view) => signed(below_nats[view]),
    level: ({ below_nats }, view) => levelOf(below_nats[view] ?? 0, NATS),
  },
  {
    id: "outside",
    label: "Outside",
    title: "Share of the part outside the silhouette of the people",
    text: ({ outside }, view) => (outside[view] === null ? "" : `${Math.round(100 * outside[view])}%`),
    level: ({ outside, usual_outside }, view) => levelOf((outside[view] ?? 0) - (usual_outside[view] ?? 0), OUTSIDE),
  },
  {
    id: "contour",
    label: "Contour",
    title: "Mean distance of the part's contour to the edges, px",
    text: ({ contour_px }, view) => contour_px[view]?.toFixed(1) ?? "",
    level: ({ contour_px, usual_contour_px }, view, { width, height }) => {
      const excess = (contour_px[view] ?? 0) - (usual_contour_px[view] ?? 0);
      return levelOf(excess / (OUTLIER_SHARE * Math.max(width, height)), CONTOUR);
    },
  },
];

/**
 * @param {{point: (cell: PartCell | null) => void, zoom: (cell: PartCell) => void}} actions point: shows which part a cell is
 *   about, until null
 */
export function reasonTable({ point, zoom }) {
  const element = make("div", "reason-scroll");
  const table = make("table", { className: "reason-table", role: "grid", "aria-label": "Parts by views" });
  element.append(table);
  /** @type {HTMLTableCellElement[][]} cells by row and view */
  let rows = [];
  /** @type {PartCell[][]} */
  let meant = [];
  const cellAt = (/** @type {EventTarget | null} */ target) => {
    const cell = target instanceof Element ? /** @type {HTMLTableCellElement | null} */ (target.closest("td")) : null;
    const row = rows.findIndex((one) => cell !== null && one.includes(cell));
    return cell === null || row < 0 ? null : { row, view: rows[row].indexOf(cell), cell };
  };
  /** @param {HTMLTableCellElement} cell the one that Tab reaches */
  const makeReachable = (cell) => {
    for (const one of rows.flat()) one.tabIndex = one === cell ? 0 : -1;
  };
  /** @param {EventTarget | null} target */
  const act = (target) => {
    const at = cellAt(target);
    if (at) zoom(meant[at.row][at.view]);
  };
  table.addEventListener("click", ({ target }) => act(target));
  table.addEventListener("pointerover", ({ target }) => {
    const at = cellAt(target);
    point(at ? meant[at.row][at.view] : null);
  });
  table.addEventListener("pointerleave", () => point(null));
  table.addEventListener("focusin", ({ target }) => {
    const at = cellAt(target);
    if (at) point(meant[at.row][at.view]);
    if (at) makeReachable(at.cell);
  });
  table.addEventListener("focusout", () => point(null));
  table.addEventListener("keydown", (event) => {
    const at = cellAt(event.target);
    const step = ARROWS.get(event.key);
    if (!at || event.altKey || event.ctrlKey || event.metaKey || !(step || event.key === "Enter" || event.key === " ")) return;
    event.preventDefault();
    event.stopPropagation(); // arrows move joints elsewhere
    if (!step) act(event.target);
    else rows[at.row - step[1]]?.[at.view + step[0]]?.focus();
  });

  return {
    element,
    clear() {
      table.replaceChildren();
      [rows, meant] = [[], []];
    },
    /** @param {{reason: ReasonMessage, measure: Measure, person: import("../model/protocol.js").PersonInfo, cameras: CameraInfo[]}} shown */
    show({ reason, measure, person, cameras }) {
      const focused = cellAt(document.activeElement);
      [rows, meant] = [[], []];
      const head = tableRow("", cameras.map(({ name }) => name), "th");
      head.classList.add("reason-views");
      for (const cell of head.cells) cell.title = cell.textContent ?? ""; // long names are cut off
      const lines = reason.limbs.flatMap((limb) => {
        const heading = tableRow(limb.name, []);
        heading.classList.add("reason-limb");
        const isNamed = limb.parts.length > 1;
        return [...(isNamed ? [heading] : []), ...limb.parts.map((part) => partRow({ reason, measure, name: person.parts[part], part, cameras }))];
      });
      table.replaceChildren(head, ...lines);
      const worst = rows.flat().find((cell) => cell.classList.contains("is-worst"));
      const reachable = focused ? rows[focused.row]?.[focused.view] : (worst ?? rows[0]?.[0]);
      if (reachable) makeReachable(reachable);
      if (focused) reachable?.focus();
    },
    /** Focus the worst cell, or the first one. */
    focus() {
      rows.flat().find(({ tabIndex }) => tabIndex === 0)?.focus();
    },
  };

  /**
   * @param {{reason: ReasonMessage, measure: Measure, name: string, part: number, cameras: CameraInfo[]}} of
   */
  function partRow({ reason, measure, name, part, cameras }) {
    const found = reason.parts[part];
    // The line above names the side.
    const row = tableRow(displayName(name).replace(/^(left|right) /, ""), cameras.map((_, view) => measure.text(found, view) || "·"));
    const cells = /** @type {HTMLTableCellElement[]} */ ([...row.children].slice(1));
    cells.forEach((cell, view) => {
      const isShown = measure.text(found, view) !== "";
      cell.dataset.level = String(isShown ? measure.level(found, view, cameras[view]) : 0);
      cell.classList.toggle("is-worst", part === reason.part && view === reason.camera);
      cell.title = describe(displayName(name), found, view, cameras[view].name);
      cell.setAttribute("aria-label", cell.title);
      cell.setAttribute("role", "gridcell");
    });
    rows.push(cells);
    meant.push(cells.map((_, camera) => ({ camera, person: reason.person, part })));
    return row;
  }
}

/**
 * All three measures of a cell in words.
 *
 * @param {string} name
 * @param {PartReason} part
 * @param {number} view
 * @param {string} camera
 */
function describe(name, { below_nats, outside, usual_outside, contour_px, usual_contour_px }, view, camera) {
  const [below, out, px] = [below_nats[view], outside[view], contour_px[view]];
  const said = [
    below === null ? "" : `colours ${Math.abs(below).toFixed(1)} nats ${below > 0 ? "below" : "above"} the usual`,
    out === null ? "" : `${Math.round(100 * out)}% outside, usually ${Math.round(100 * (usual_outside[view] ?? 0))}%`,
    px === null ? "" : `contour ${px.toFixed(1)} px from edges, usually ${(usual_contour_px[view] ?? 0).toFixed(1)}`,
  ].filter(Boolean);
  return `${name} in ${camera}: ${said.join("; ") || "hidden"}. Enter zooms to it`;
}

/**
 * Format evidence below the usual as evidence against it.
 *
 * @param {number | null} below nats
 */
function signed(below) {
  if (below === null) return "";
  const rounded = -Math.round(below);
  return rounded < 0 ? `−${-rounded}` : rounded > 0 ? `+${rounded}` : "0";
}

/**
 * @param {number} value
 * @param {number[]} from the least value of each level above 0
 */
function levelOf(value, from) {
  return from.filter((least) => value > least).length;
}
