/** Sizes from the footage: start and stop an acquisition, its progress, and the body before and after. */

import { make, makeSvg, makeTable, tableRow, textButton } from "../widgets/elements.js";
import { capital } from "../widgets/text.js";
import { workRow } from "./parts.js";
import { choiceRow } from "./rows.js";

/**
 * @typedef {import("../model/protocol.js").AcquisitionMessage} Acquisition
 * @typedef {import("../model/protocol.js").AcquisitionResult} Result
 * @typedef {import("../model/protocol.js").SideOutlines} SideOutlines
 * @typedef {NonNullable<import("../model/protocol.js").AcquireSizes["method"]>} Method
 */

/** Number of sizes that are listed: those that changed most. */
const LISTED = 8;

/**
 * @param {import("../model/index.js").Context} context
 * @returns {{element: HTMLElement, update: (person: number) => void}}
 */
export function acquisitionView({ store, send }) {
  const element = make("div", "acquisition");
  let person = 0;
  /** @type {Method} */
  let method = "contours";
  const start = textButton("Acquire from footage", "Fit all sizes to several frames; nothing changes until you apply them", () =>
    send({ type: "acquire", action: "start", person, method }),
  );
  const how =
    "Contours: fit all sizes to the contours of several frames in all views. " +
    "Voxels first: fit lengths and girths to the labelled voxels of the silhouettes, and start the fit to contours there";
  const choice = choiceRow("Fit to", how, { contours: "Contours", voxels: "Voxels first" }, (value) => (method = value));
  const work = workRow("Stop the acquisition; the sizes stay as they are", () => send({ type: "acquire", action: "stop", person }), { className: "section-note acquisition-status", "aria-live": "polite" });
  const result = make("div");
  element.append(choice.element, start, work.element, work.status, result);
  /** @type {Result | null} */
  let drawn = null;

  return {
    element,
    update(active) {
      person = active;
      const { acquisition, session } = store.facts;
      const people = session?.people ?? [];
      const running = acquisition?.running ?? false;
      start.hidden = choice.element.hidden = running;
      const name = people[acquisition?.person ?? 0]?.name ?? "";
      const isOwn = acquisition?.person === person;
      work.show(acquisition, running ? `${name}: ${acquisition?.stage}` : isOwn ? acquisition.message : "");
      const found = acquisition && isOwn && !running ? acquisition.result : null;
      result.hidden = !found;
      if (found && found !== drawn) result.replaceChildren(...describe(found));
      drawn = found ?? drawn;
      element.style.setProperty("--person", people[person]?.color ?? "");
    },
  };
}

/** @param {Result} result */
function describe(result) {
  const { frames, cost_before_px: before, cost_after_px: after } = result;
  const summary = make("p", { className: "section-note", title: "Frames that the sizes were fitted to, and their mean cost with the body before and after" }, `Frames ${frames.join(", ")}: ${before.toFixed(2)} → ${after.toFixed(2)} px`);
  const pictures = make("div", "acquisition-pictures", picture(result, result.front, "Front"), picture(result, result.side, "Side"));
  const legend = make("p", "section-note acquisition-legend", ...["before", "after"].map((kind) => make("span", `is-${kind}`, kind)));
  return [summary, pictures, legend, table(result)];
}

/**
 * @param {Result} result
 * @param {SideOutlines} outlines
 * @param {string} name
 */
function picture({ size_px: [width, height] }, { before, after }, name) {
  const outline = (/** @type {number[][]} */ lines, /** @type {string} */ kind) =>
    makeSvg("path", { class: kind, d: lines.map(([x0, y0, x1, y1]) => `M${x0} ${y0}L${x1} ${y1}`).join("") });
  const place = { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": `${name}: the body before and after` };
  const svg = makeSvg("svg", place, outline(before, "is-before"), outline(after, "is-after"));
  return make("figure", {}, svg, make("figcaption", {}, name));
}

/** @param {Result} result */
function table({ sizes }) {
  const rows = sizes.slice(0, LISTED).map(({ name, before_m, after_m, sigma_m }) => {
    const row = tableRow(capital(name), [before_m, after_m, sigma_m].map((metres) => (100 * metres).toFixed(1)));
    row.cells[0].title = capital(name);
    row.cells[3].title = "Standard deviation of the size after the acquisition";
    return row;
  });
  return makeTable("acquisition-sizes number-table", [["Changed most, cm"], ["before"], ["after"], ["±"]], rows);
}
