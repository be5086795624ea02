/** Calibration: check the cameras by the tracked people, preview the corrections, apply them, and track again. */

import { make, makeTable, tableRow, textButton } from "../widgets/elements.js";
import { KEYFRAME } from "../model/cells.js";
import { earlierCalibration, hasTrack } from "../model/selectors.js";
import { count, sentence } from "../widgets/text.js";
import { group, workRow } from "./parts.js";
import { command } from "../widgets/key_matching.js";
import { sectionNote } from "./rows.js";

/**
 * @typedef {import("../model/protocol.js").CameraCheck} CameraCheck
 * @typedef {import("../model/protocol.js").CalibrationMessage} Calibration
 * @typedef {import("../model/protocol.js").CheckCalibration["action"]} Action
 */

/** @type {Record<string, string>} */
const WORDS = { rotation: "turned", position: "moved", focal: "zoomed", time: "shifted in time", drift: "drifting in time" };
const COLUMNS = [
  ["Camera", "Cameras of the session"],
  ["px", "Distance by which the body is off in the pictures"],
  ["mm", "The same at the body"],
  ["Mended by", "Correction with its standard deviation"],
];
/** Names of the numbers of each kind, their unit and decimals. @type {Record<string, {names: [string, string][], unit: string, digits: number}>} */
const NUMBERS = {
  rotation: {
    names: [["pitch", "Turn about the axis to the right"], ["yaw", "Turn about the axis down"], ["roll", "Turn about the axis forward"]],
    unit: "°",
    digits: 2,
  },
  position: {
    names: [["right", "Along the axis to the right"], ["down", "Along the axis down"], ["forward", "Along the line of sight"]],
    unit: " mm",
    digits: 0,
  },
  focal: { names: [["zoom", "Focal length"]], unit: " %", digits: 2 },
  time: { names: [["time", "Its pictures were taken later by this"]], unit: " ms", digits: 1 },
  drift: { names: [["drift", "Its pictures are later by this after each second"]], unit: " ms/s", digits: 1 },
}; // prettier-ignore

/**
 * @param {import("../model/index.js").Context} context
 * @returns {import("./inspector.js").Section}
 */
export function calibrationSection({ store, send }) {
  const act = (/** @type {Action} */ action) => send({ type: "calibration_check", action });
  const title = "Compare contours of the tracked people with the calibration; changes nothing";
  const start = textButton("Check the cameras", title, () => act("start"), { className: "is-primary" });
  const work = workRow("Stop the check; nothing is changed", () => act("stop"));
  const result = make("div");
  const preview = textButton("Preview", "Show the people and cameras as corrected, on the shown frame", () =>
    act(store.facts.calibration?.is_previewed ? "leave" : "preview"),
  );
  const apply = textButton("Apply", "Correct the cameras; undo restores them. Poses stay until they are tracked again", () => act("apply"));
  const misfits = textButton("Misfits", "Show in each view how the edges lie off the contours, magnified: all one way for a turned camera, round for a rolled one, outwards or inwards for a zoomed one", () =>
    store.set({ showsMisfits: !store.facts.showsMisfits }),
  ); // prettier-ignore
  const buttons = group(misfits, preview, apply);
  const fit = sectionNote();
  const outdated = sectionNote();
  const again = textButton("Track again", "Track the frames of an earlier calibration with the present one; keyframes stay", () => act("track_again"));
  const body = make("div", "acquisition", start, work.element, work.status, result, buttons, fit, outdated, again);

  const isNamed = () => !!store.facts.calibration?.cameras.some(({ kinds }) => kinds.length);

  /** @param {Calibration} found */
  const show = (found) => {
    const named = isNamed();
    start.hidden = found.running;
    work.show(found);
    result.hidden = !found.is_checked;
    if (found.is_checked) result.replaceChildren(...describe(found));
    buttons.hidden = !found.is_checked;
    preview.hidden = apply.hidden = !named;
    misfits.setAttribute("aria-pressed", String(store.facts.showsMisfits));
    misfits.disabled = found.is_previewed;
    preview.setAttribute("aria-pressed", String(found.is_previewed));
    apply.disabled = found.refused !== "";
    fit.hidden = !named;
    fit.textContent = found.refused ? sentence(found.refused) : fitText(found, store.facts.state?.frame ?? -1);
    const { tracked, keyframes } = earlierPoses(store.facts);
    outdated.hidden = tracked + keyframes === 0;
    again.hidden = tracked === 0;
    again.disabled = hasTrack(store.facts.state);
    outdated.textContent = sentences(tracked, keyframes).join(" ");
  };

  store.on(["calibration", "showsMisfits", "state", "timeline", "lanes"], () => store.facts.calibration && show(store.facts.calibration));
  const bindings = (/** @type {() => void} */ reveal) => {
    const noCamera = () => (isNamed() ? null : "No camera is known to be off. Check the cameras first.");
    const binding = (/** @type {string} */ label, /** @type {string} */ words, /** @type {() => string | null} */ why, /** @type {() => void} */ run) =>
      command(label, `${words} calibration`, () => (reveal(), run()), why);
    const notChecked = () => (store.facts.calibration?.is_checked ? null : "There is no check. Check the cameras first.");
    /** @type {[string, string, Action | (() => Action), () => string | null][]} */
    const actions = [
      ["Check the cameras", "contours body wrong moved turned", "start", () => (store.facts.calibration?.running ? "The check is at work." : null)],
      ["Preview the corrected cameras (toggle)", "", () => (store.facts.calibration?.is_previewed ? "leave" : "preview"), noCamera],
      ["Apply the correction of the cameras", "repair", "apply", () => noCamera() ?? (sentence(store.facts.calibration?.refused ?? "") || null)],
      ["Track again what is of an earlier calibration", "retrack", "track_again", () =>
        earlierPoses(store.facts).tracked ? null : "No tracked pose is of an earlier calibration."],
    ]; // prettier-ignore
    return [
      ...actions.map(([label, words, action, why]) => binding(label, words, why, () => act(typeof action === "string" ? action : action()))),
      binding("Show where contours miss the edges (toggle)", "misfits residuals arrows field", notChecked, () =>
        store.set({ showsMisfits: !store.facts.showsMisfits }),
      ),
    ];
  };
  return { id: "calibration", title: "Calibration", hint: "Check the cameras by the tracked people, and correct them", body, bindings };
}

/**
 * Number of tracked poses and of keyframes that are of an earlier calibration.
 *
 * @param {import("../model/store.js").Facts} facts
 */
function earlierPoses(facts) {
  const { lanes, timeline } = facts;
  const found = { tracked: 0, keyframes: 0 };
  earlierCalibration(facts).forEach((frames, person) => {
    const { marks } = lanes[person] ?? timeline;
    for (const frame of frames) found[marks[frame] & KEYFRAME ? "keyframes" : "tracked"] += 1;
  });
  return found;
}

/**
 * @param {number} tracked
 * @param {number} keyframes
 */
function sentences(tracked, keyframes) {
  const said = [];
  if (tracked) said.push(`${count(tracked)} ${tracked === 1 ? "pose is" : "poses are"} of an earlier calibration.`);
  if (keyframes) said.push(`${count(keyframes)} ${keyframes === 1 ? "keyframe was" : "keyframes were"} set under it and ${keyframes === 1 ? "stays" : "stay"}.`);
  return said;
}

/**
 * @param {Calibration} found
 * @param {number} frame that is shown
 */
function fitText(found, frame) {
  const others = found.others ? `Of ${found.others} other frames, ${found.better} fit better when corrected.` : "";
  if (!found.is_previewed) return others;
  if (found.preview_frame !== frame) return `${others} Fitting this frame …`;
  const { preview_fall_nats: fall } = found;
  return `${others} This frame fits ${fall >= 0 ? "better" : "worse"} by ${Math.abs(fall).toFixed(0)} nats.`;
}

/** @param {Calibration} found */
function describe(found) {
  const said = found.sentences.length ? found.sentences.map(sentence) : ["No camera is off: the contours agree with the calibration."];
  const notes = said.map((text) => sectionNote(text));
  const rows = found.cameras.map((camera) => {
    const misfits = camera.is_seen ? [camera.misfit_px.toFixed(1), camera.misfit_mm.toFixed(0)] : ["–", "–"];
    const row = tableRow(camera.name, misfits);
    row.classList.toggle("is-off", camera.kinds.length > 0);
    row.append(make("td", {}, ...mended(camera).map(({ text, title }) => make("div", { title }, text))));
    return row;
  });
  return [...notes, makeTable("calibration-cameras", COLUMNS, rows), sectionNote(`Frames used: ${found.frames.join(", ")}`)];
}

/**
 * @param {CameraCheck} camera
 * @returns {{text: string, title: string}[]}
 */
function mended(camera) {
  if (!camera.is_seen) return [{ text: "shows nobody", title: "Camera without contours of the people on these frames" }];
  if (!camera.kinds.length) return [{ text: "–", title: "Nothing to correct: the misfit is that of the likeliest correction" }];
  if (camera.lost_frames) {
    const [n, verb] = [Math.abs(camera.lost_frames), camera.lost_frames > 0 ? "lost" : "doubled"];
    const title = "Its clock jumps by whole frames there; images stay as they are";
    return [{ text: `${n} frame${n > 1 ? "s" : ""} ${verb} before frame ${camera.since_frame}`, title }];
  }
  const { sigma } = camera;
  /** @type {Record<string, [number[], number[]]>} */
  const of = {
    rotation: [camera.rotation_deg, sigma.rotation_deg],
    position: [camera.position_mm, sigma.position_mm],
    focal: [[camera.focal_percent], sigma.focal_percent],
    time: [[camera.time_ms], sigma.time_ms],
    drift: [[camera.drift_ms_per_s], sigma.drift_ms_per_s],
  };
  const lines = camera.kinds.flatMap((kind) => {
    const { names, unit, digits } = NUMBERS[kind];
    const [values, sigmas] = of[kind];
    return names.map(([name, title], i) => ({ text: `${name} ${signed(values[i], digits)} ± ${sigmas[i].toFixed(digits)}${unit}`, title }));
  });
  if (camera.since_frame !== null) lines.push({ text: `since frame ${camera.since_frame}`, title: "" });
  for (const [kind, values] of Object.entries(camera.rivals)) {
    const { names, unit, digits } = NUMBERS[kind];
    const numbers = names.map(([name], i) => `${name} ${signed(values[i], digits)}${unit}`);
    lines.push({ text: `or ${WORDS[kind]}: ${numbers.join(", ")}`, title: "Explains the contours as well" });
  }
  return lines;
}

/**
 * @param {number} value
 * @param {number} digits
 */
function signed(value, digits) {
  return value.toFixed(digits).replace("-", "−");
}
