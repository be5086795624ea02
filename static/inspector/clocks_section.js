/** Clocks: when each camera took its pictures, nudged by hand, estimated, and compared at a fast moment. */

import { make, textButton } from "../widgets/elements.js";
import { keyOf } from "../model/pictures.js";
import { workRow } from "./parts.js";
import { command } from "../widgets/key_matching.js";
import { sentence } from "../widgets/text.js";
import { NO_OPTIONS, choiceRow, sectionNote } from "./rows.js";

/**
 * @typedef {import("../model/protocol.js").UseClocks} Use
 * @typedef {NonNullable<Use["way"]>} Way
 */

/** @type {Record<Way, string>} */
const WAYS = { motion: "Motion", sound: "Sound", flash: "Flash", "time code": "Time code" };
const COLUMNS = [
  ["Camera", "Cameras of the session"],
  ["frames", "Frame of the footage at the time of frame 0"],
  ["ms", "The same in milliseconds"],
  ["ms/s", "Drift: its pictures are later by this after each second"],
];
/** Side of a picture of the fast moment, as a share of the shorter side of the footage. */
const SHARE = 1 / 3;
/** Side of its canvas: twice that on the screen, for dense displays. */
const SIDE_PX = 252;

/**
 * @param {import("../model/index.js").Context} context
 * @returns {import("./inspector.js").Section}
 */
export function clocksSection({ store, send, navigation }) {
  let [camera, other, isAsked] = [0, 1, false];
  /** @type {Way} */
  let way = "motion";
  const use = (/** @type {Use["action"]} */ action, /** @type {Partial<Use>} */ more = {}) => send({ type: "clocks", action, ...more });
  const names = () => store.facts.session?.cameras.map(({ name }) => name) ?? [];
  const fps = () => store.facts.session?.fps ?? 1;
  const findMoment = () => {
    isAsked = true;
    use("moment", { camera, other });
  };
  const nudges = [
    { text: "− frame", label: "a frame earlier", by: () => -1 },
    { text: "− ms", label: "a millisecond (ms) earlier", by: () => -fps() / 1000 },
    { text: "+ ms", label: "a millisecond (ms) later", by: () => fps() / 1000 },
    { text: "+ frame", label: "a frame later", by: () => 1 },
  ].map(({ text, label, by }) => ({ text, label, run: () => use("nudge", { camera, frames: by() }) }));

  const table = make("table", "number-table");
  const choice = choiceRow("Camera", "Camera that is nudged", NO_OPTIONS, (value) => choose(Number(value), other));
  const buttons = nudges.map(({ text, label, run }) => textButton(text, `Show pictures taken ${label}; undo restores the clock`, run));
  const beside = choiceRow("Beside", "Camera to compare with", NO_OPTIONS, (value) => choose(camera, Number(value)));
  const find = textButton("Fast moment", "Go to a frame on which something moves fast in both views, and show them side by side", findMoment);
  const figures = [0, 1].map(() => ({ canvas: make("canvas", { width: SIDE_PX, height: SIDE_PX }), caption: make("figcaption") }));
  const pictures = make("div", "acquisition-pictures", ...figures.map(({ canvas, caption }) => make("figure", {}, canvas, caption)));
  const source = sectionNote();
  const ways = choiceRow("Estimate by", "Data that the clocks are estimated by", WAYS, (value) => (way = value));
  const start = textButton("Estimate", "Estimate when each camera began; nothing changes until an estimate is taken", () => use("estimate", { way }));
  const work = workRow("Stop; nothing is changed", () => use("stop"));
  const estimates = make("ul", "find-notes");
  const notes = sectionNote();
  const nudging = make("div", "acquisition-work clock-nudges", ...buttons);
  const body = make("div", "acquisition", table, choice.element, nudging, beside.element, find, pictures, source, ways.element, start);
  body.append(work.element, work.status, estimates, notes);

  const choose = (/** @type {number} */ one, /** @type {number} */ two) => {
    other = two === one ? camera : two;
    camera = one;
    show();
  };
  /** Whether a camera has a clear estimate that differs from its clock. @param {number} i */
  const canTake = (i) => {
    const clock = store.facts.clocks?.cameras[i];
    const found = clock?.found;
    const isNew = found?.offset_frames !== clock?.offset_frames || (found?.drift_ms_per_s ?? clock?.drift_ms_per_s) !== clock?.drift_ms_per_s;
    return isNew && !!found?.is_clear;
  };

  const show = () => {
    const found = store.facts.clocks;
    if (!found) return;
    const head = COLUMNS.map(([text, title]) => make("th", { title, scope: "col" }, text));
    const rows = found.cameras.map(({ offset_frames: frames, drift_ms_per_s: drift }, i) => {
      const cells = numbers(frames, drift, fps()).map((text) => make("td", {}, text));
      return make("tr", i === camera ? "is-off" : "", make("th", { scope: "row" }, names()[i]), ...cells);
    });
    table.replaceChildren(make("thead", {}, make("tr", {}, ...head)), make("tbody", {}, ...rows));
    for (const row of [choice, beside]) {
      row.fill(names().map((name, i) => [String(i), name]));
      row.show(String(row === choice ? camera : other));
    }
    start.hidden = found.running;
    find.disabled = found.running || names().length < 2;
    work.show(found);
    estimates.replaceChildren(...found.cameras.flatMap(({ found: estimate }, i) => (estimate ? [entry(found.way, estimate, i)] : [])));
    notes.textContent = found.notes.map(sentence).join(" ");
    const hasArrived = isAsked && !found.running && found.moment && !found.failed;
    if (!found.running) isAsked = false;
    draw();
    if (!hasArrived || !found.moment) return;
    navigation.pause();
    navigation.goTo(found.moment.frame);
    pictures.scrollIntoView({ block: "nearest" });
  };

  /**
   * @param {string} by
   * @param {import("../model/protocol.js").FoundClock} found
   * @param {number} i index of the camera
   */
  const entry = (by, { offset_frames: frames, drift_ms_per_s: drift, sigma_ms: sigma, is_clear: isClear }, i) => {
    if (frames === null) return make("li", {}, `${names()[i]} by ${by}: nothing found`);
    const [offset, ms, rate] = numbers(frames, drift ?? 0, fps());
    const spread = sigma === null ? "" : ` ± ${sigma.toPrecision(2)}`;
    const text = `${names()[i]} by ${by}: ${offset} frames, ${ms}${spread} ms${drift ? `, ${rate} ms/s` : ""}, ${isClear ? "clear" : "not clear"} `;
    const take = textButton("Take", `Give ${names()[i]} this clock; undo restores the former one`, () => use("take", { camera: i }));
    return make("li", {}, text, ...(canTake(i) ? [take] : []));
  };

  /** Draw the pictures that the panes show, around the point that moves fast. */
  const draw = () => {
    const { clocks, session, shown } = store.facts;
    const moment = clocks?.moment;
    pictures.hidden = source.hidden = !moment;
    if (!moment || !session) return;
    source.textContent = `Frame ${moment.frame}, by ${moment.source}. Nudge until both views show the same instant.`;
    moment.views.forEach((view, i) => {
      const { width, height, name } = session.cameras[view];
      const bitmap = shown?.pictures.get(keyOf("image", view))?.bitmap;
      const [u, v] = moment.centers[i];
      const side = SHARE * Math.min(width, height);
      const from = (/** @type {number} */ center, /** @type {number} */ size) => Math.max(0, Math.min(size - side, center - side / 2));
      figures[i].caption.textContent = name;
      if (!bitmap) return;
      const box = [from(u, width), from(v, height), side, side].map((px) => (px * bitmap.width) / width);
      figures[i].canvas.getContext("2d")?.drawImage(bitmap, box[0], box[1], box[2], box[3], 0, 0, SIDE_PX, SIDE_PX);
    });
  };

  store.on(["clocks", "session"], show);
  store.on(["shown"], draw);
  const bindings = (/** @type {() => void} */ reveal) => {
    const busy = () => (store.facts.clocks?.running ? "Work on the clocks is under way." : names().length < 2 ? "There is one camera." : null);
    const bound = (/** @type {string} */ label, /** @type {() => void} */ run, /** @type {() => string | null} */ why) =>
      command(label, "clock time offset synchronize", () => (reveal(), run()), why);
    return [
      ...nudges.map(({ label, run }) => bound(`Nudge the clock: ${label}`, run, () => null)),
      .../** @type {Way[]} */ (Object.keys(WAYS)).map((of) =>
        bound(`Estimate the clocks: ${WAYS[of].toLowerCase()}`, () => use("estimate", { way: of }), busy)),
      bound("Compare two views at a fast moment", findMoment, busy),
      bound("Take the estimated clock of the camera", () => use("take", { camera }), () =>
        canTake(camera) ? null : "No clear estimate differs from the clock of the chosen camera."),
    ]; // prettier-ignore
  };
  return { id: "clocks", title: "Clocks", hint: "When each camera took its pictures: nudge, estimate, compare", body, bindings };
}

/**
 * @param {number} frames
 * @param {number} drift ms/s
 * @param {number} fps
 */
function numbers(frames, drift, fps) {
  const texts = [frames.toFixed(3), ((1000 * frames) / fps).toFixed(1), drift.toFixed(3)];
  return texts.map((text) => text.replace(/^-(?=.*[1-9])/, "−").replace("-", ""));
}
