/** Legend of the poses that the panes show besides the stored ones: replayed, tested, compared, previewed, alternative. */

import { byId, make, makeSvg } from "../widgets/elements.js";
import { shownMisfits } from "../model/selectors.js";
import { LINE_STYLES } from "./drawing.js";

/**
 * @typedef {import("../model/protocol.js").Path["kind"]} Kind
 * @typedef {import("../model/protocol.js").StateMessage} StateMessage
 */

const SAMPLE_PX = 30;

/** @typedef {import("../model/protocol.js").CalibrationMessage} Calibration */
/** Kinds of outlines in the legend, with their names. @type {Partial<Record<Kind, (state: StateMessage, calibration: Calibration | null, copy: string) => string>>} */
const NAMES = {
  candidate: () => "tested pose",
  compared: ({ compared_run, replay }) =>
    compared_run !== null ? `run ${compared_run}` : replay ? "start of the fit" : "replaced pose",
  preview: ({ preview }, calibration) =>
    calibration?.is_previewed ? "with corrected cameras" : preview ? `candidate ${preview.candidate + 1} of run ${preview.run}` : "candidate",
  alternative: () => "alternative pose",
  result: ({ compared }) => `result of the ${compared?.work}`,
  new_sizes: () => "new body sizes",
  former: () => "limb before the fit",
  other_copy: (_state, _calibration, copy) => copy || "other copy",
};

/** @param {import("../model/store.js").Store} store */
export function mountPoseLegend(store) {
  const element = byId("pose-legend", HTMLElement);
  let shown = "";
  store.on(["state", "overlay", "calibration", "showsMisfits", "layers"], show);

  function show() {
    const { state, overlay, layers, session, calibration, otherCopy } = store.facts;
    if (!state || !overlay) return;
    const replay = state.replay && `Replay of run ${state.replay.run}, step ${state.replay.step + 1} of ${state.replay.steps}`;
    /** @type {Map<Kind, string>} colours of the kinds that are visible */
    const colors = new Map();
    for (const { kind, color, count } of overlay.paths) {
      const { layer } = LINE_STYLES[kind];
      if (count > 0 && (layer === null || layers.shown[layer])) colors.set(kind, color);
    }
    const lines = Object.entries(NAMES).flatMap(([name, label]) => {
      const [kind, color] = [/** @type {Kind} */ (name), colors.get(/** @type {Kind} */ (name))];
      return color ? [{ kind, color, text: label(state, calibration, otherCopy?.name ?? "") }] : [];
    });
    if (replay && colors.has("model")) {
      lines.unshift({ kind: "model", color: session?.people[state.person].color ?? "#fff", text: "best pose so far" });
    }
    const misfits = shownMisfits(store.facts).length > 0 ? `misfit × ${calibration?.misfit_factor}` : "";
    const texts = [misfits, replay, ...(replay && !colors.has("model") ? ["contours are hidden"] : []), replay && "Esc exits"];
    const described = JSON.stringify([texts, lines]);
    if (described === shown) return;
    shown = described;
    element.hidden = !replay && !misfits && lines.length === 0;
    element.replaceChildren(...texts.filter(Boolean).map((text) => entry(text ?? "")), ...lines.map((line) => entry(line.text, line)));
  }
}

/**
 * @param {string} text
 * @param {{kind: Kind, color: string}} [line] of which a sample is drawn
 */
function entry(text, line) {
  return make("span", {}, ...(line ? [sampleOf(line.kind, line.color)] : []), text);
}

/**
 * Sample of a line as the panes draw it.
 *
 * @param {Kind} kind
 * @param {string} color
 */
export function sampleOf(kind, color) {
  const { width, dash } = LINE_STYLES[kind];
  const line = { d: `M0 4H${SAMPLE_PX}`, stroke: color, "stroke-width": width, "stroke-dasharray": dash.join(" ") };
  const place = { viewBox: `0 0 ${SAMPLE_PX} 8`, "aria-hidden": "true", class: "line-sample over-image" };
  return makeSvg("svg", place, makeSvg("path", line));
}
