/** Best candidates of a search as stick figures, in the view where they differ most. */

import { stroke } from "../panes/drawing.js";
import { prepare } from "../widgets/canvas.js";
import { byId, make } from "../widgets/elements.js";
import { keyOf } from "../model/pictures.js";
import { selectedRun } from "../model/search_runs.js";

const WIDTH = 76;
const HEIGHT = 58;
/** Margin as a fraction of the figures' size. */
const MARGIN = 0.08;

/**
 * @param {import("../model/store.js").Store} store
 * @param {(message: import("../model/protocol.js").ClientMessage) => void} send
 */
export function mountCandidateStrip(store, send) {
  const element = byId("candidates", HTMLElement);
  const list = make("div", "strip-list");
  const label = make("span", "strip-label");
  /** @type {unknown[]} the arguments of the last drawing; candidates change less often than steps */
  let drawnFrom = [];
  element.append(label, list);
  store.onTab("search", ["searchCandidates", "searchRun", "filled", "shown"], show);

  function show() {
    const { searchCandidates, session, filled, shown } = store.facts;
    const run = selectedRun(store.facts);
    const found = searchCandidates.get(run?.number ?? -1);
    const n = run ? (found?.costs.length ?? 0) : 0;
    while (list.children.length > n) list.lastElementChild?.remove();
    while (list.children.length < n) list.append(build(list.children.length));
    const camera = filled ?? found?.clearest_view ?? 0;
    const drawn = [found, camera, session, devicePixelRatio, shown?.pictures.get(keyOf("image", camera))?.bitmap];
    if (drawn.every((one, index) => one === drawnFrom[index])) return;
    drawnFrom = drawn;
    label.textContent = n ? `Best, ${session?.cameras[camera]?.name ?? ""}` : "";
    label.title =
      "The best candidates that differ by 3 cm or more, in the view that fills the grid or else the view where they differ most";
    if (!found || n === 0 || !session) return;
    const box = frameOf(found, camera);
    [...list.children].forEach((element, index) => {
      const cost = found.costs[index];
      const text = cost === null ? "–" : cost.toFixed(2);
      const output = element.querySelector("output");
      if (output) output.textContent = text;
      const hint = "Point at it to preview it in all views, click to use it (can be undone)";
      /** @type {HTMLElement} */ (element).title = `Candidate ${index + 1}, ${text} px. ${hint}`;
      element.setAttribute("aria-label", `Use candidate ${index + 1}, ${text} px`);
      const canvas = element.querySelector("canvas");
      if (canvas) draw(canvas, found, index, camera, box);
    });
  }

  /** @param {number} index */
  function build(index) {
    const element = make("button", { type: "button", className: "candidate" }, make("canvas"), make("output"));
    const preview = (/** @type {number | null} */ candidate) => {
      const run = selectedRun(store.facts);
      if (run) send({ type: "preview", run: run.number, candidate });
    };
    element.addEventListener("pointerenter", () => preview(index));
    element.addEventListener("pointerleave", () => preview(null));
    element.addEventListener("focus", () => element.matches(":focus-visible") && preview(index));
    element.addEventListener("blur", () => preview(null));
    element.addEventListener("click", (event) => {
      if (event.detail > 0) element.blur();
      const run = selectedRun(store.facts);
      if (run) send({ type: "take", run: run.number, candidate: index });
    });
    return element;
  }

  /**
   * @param {HTMLCanvasElement} canvas
   * @param {import("../model/search_runs.js").Candidates} found
   * @param {number} index
   * @param {number} camera
   * @param {{u: number, v: number, width: number, height: number}} box
   */
  function draw(canvas, found, index, camera, box) {
    const { session, shown } = store.facts;
    canvas.style.width = `${WIDTH}px`;
    canvas.style.height = `${HEIGHT}px`;
    const context = prepare(canvas, WIDTH, HEIGHT, true);
    const scale = Math.min(WIDTH / box.width, HEIGHT / box.height);
    const x0 = WIDTH / 2 - scale * (box.u + box.width / 2);
    const y0 = HEIGHT / 2 - scale * (box.v + box.height / 2);
    const bitmap = shown?.pictures.get(keyOf("image", camera))?.bitmap;
    const info = session?.cameras[camera];
    if (bitmap && info && bitmap.width > 0) {
      context.globalAlpha = 0.55;
      context.drawImage(bitmap, x0 - 0.5 * scale, y0 - 0.5 * scale, info.width * scale, info.height * scale);
      context.globalAlpha = 1;
    }
    const each = found.people.reduce((sum, n) => sum + n, 0);
    let first = 2 * each * (index * found.cameras + camera);
    session?.people.forEach((person, p) => {
      const line = new Path2D();
      const at = (/** @type {string} */ name) => {
        const i = first + 2 * person.points.indexOf(name);
        return /** @type {[number, number]} */ ([x0 + scale * found.points[i], y0 + scale * found.points[i + 1]]);
      };
      for (const [from, to] of person.bones) {
        const [a, b] = [at(from), at(to)];
        if (![...a, ...b].every(Number.isFinite)) continue;
        line.moveTo(...a);
        line.lineTo(...b);
      }
      stroke(context, line, person.color, 1.75);
      first += 2 * found.people[p];
    });
  }
}

/**
 * Box of all candidates in a view, with a margin.
 *
 * @param {import("../model/search_runs.js").Candidates} found
 * @param {number} camera
 */
function frameOf(found, camera) {
  const each = 2 * found.people.reduce((sum, n) => sum + n, 0);
  let [left, right, top, bottom] = [Infinity, -Infinity, Infinity, -Infinity];
  found.costs.forEach((_, index) => {
    const first = each * (index * found.cameras + camera);
    for (let i = first; i < first + each; i += 2) {
      const [u, v] = [found.points[i], found.points[i + 1]];
      if (!Number.isFinite(u) || !Number.isFinite(v)) continue;
      [left, right] = [Math.min(left, u), Math.max(right, u)];
      [top, bottom] = [Math.min(top, v), Math.max(bottom, v)];
    }
  });
  if (!(right > left) || !(bottom > top)) return { u: 0, v: 0, width: 1, height: 1 };
  const margin = MARGIN * Math.max(right - left, bottom - top);
  return { u: left - margin, v: top - margin, width: right - left + 2 * margin, height: bottom - top + 2 * margin };
}
