/** Calibration: check the cameras by the tracked people, preview the corrections, apply them, and track again. */

import { textButton } from "./rows.js";

/**
 * @typedef {import("../model/protocol.js").CameraCheck} CameraCheck
 * @typedef {import("../model/protocol.js").CalibrationMessage} Calibration
 * @typedef {import("../model/protocol.js").CheckCalibration["action"]} Action
 */

/** @type {Record<string, string>} */
const WORDS = { rotation: "turned", position: "moved", focal: "zoomed", time: "shifted in time", drift: "drifting in time" };
const AXES = "right, down, forward axis";

/**
 * @param {import("../model/index.js").Context} context
 * @returns {import("./inspector.js").Section}
 */
export function calibrationSection({ store, send }) {
  const act = (/** @type {Action} */ action) => send({ type: "calibration_check", action });
  const start = textButton("Check the cameras", "Compare contours of the tracked people with the calibration; changes nothing", () => act("start"));
  start.className = "is-primary";
  const stop = textButton("Stop", "Stop the check; nothing is changed", () => act("stop"));
  const progress = document.createElement("progress");
  const work = document.createElement("div");
  work.className = "acquisition-work";
  work.append(progress, stop);
  const status = note();
  status.setAttribute("role", "status");
  const result = document.createElement("div");
  const preview = textButton("Preview", "Show the people and cameras as corrected, on the shown frame", () =>
    act(store.facts.calibration?.is_previewed ? "leave" : "preview"),
  );
  const apply = textButton("Apply", "Correct the cameras; undo restores them. Poses stay until they are tracked again", () => act("apply"));
  const buttons = document.createElement("div");
  buttons.className = "acquisition-work";
  buttons.append(preview, apply);
  const fit = note();
  const outdated = note();
  const again = textButton("Track again", "Track all frames with the present calibration, from a frame with a pose: keyframes stay", () =>
    retrack(),
  );
  const body = document.createElement("div");
  body.className = "acquisition";
  body.append(start, work, status, result, buttons, fit, outdated, again);

  function retrack() {
    const { session, state } = store.facts;
    if (session && state) send({ type: "range", action: "track_forward", first: 0, last: session.n_frames - 1 });
  }

  /** @param {Calibration} found */
  const show = (found) => {
    const named = found.cameras.some(({ kinds }) => kinds.length);
    start.hidden = found.running;
    work.hidden = !found.running;
    progress.value = found.share;
    status.textContent = found.running ? `${found.stage} …` : found.message;
    status.hidden = !status.textContent;
    status.classList.toggle("is-failed", found.failed);
    result.hidden = !found.is_checked;
    if (found.is_checked) result.replaceChildren(...describe(found));
    buttons.hidden = !named;
    preview.setAttribute("aria-pressed", String(found.is_previewed));
    apply.disabled = found.refused !== "";
    fit.hidden = !named;
    fit.textContent = found.refused ? capital(found.refused) : fitText(found, store.facts.state?.frame ?? -1);
    const n = new Set(found.outdated.flat()).size;
    outdated.hidden = again.hidden = n === 0;
    outdated.textContent = `${n} frame${n === 1 ? " has a pose" : "s have poses"} of an earlier calibration.`;
  };

  return {
    id: "calibration",
    title: "Calibration",
    hint: "Check the cameras by the tracked people, and correct them",
    body,
    update(changed) {
      const { calibration } = store.facts;
      if (calibration && (changed.has("calibration") || changed.has("state"))) show(calibration);
    },
  };
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
  const said = found.sentences.length ? found.sentences.map(capital) : ["No camera is off: the contours agree with the calibration."];
  const notes = said.map((text) => Object.assign(note(), { textContent: text }));
  const table = document.createElement("table");
  table.className = "calibration-cameras";
  const head = table.createTHead().insertRow();
  for (const [text, title] of [
    ["Camera", "Cameras of the session"],
    ["px", "Distance by which the body is off in the pictures"],
    ["mm", "The same at the body"],
    ["Mended by", "Correction with its standard deviation"],
  ]) {
    head.append(Object.assign(document.createElement("th"), { textContent: text, title, scope: "col" }));
  }
  const rows = table.createTBody();
  for (const camera of found.cameras) {
    const row = rows.insertRow();
    row.classList.toggle("is-off", camera.kinds.length > 0);
    row.append(Object.assign(document.createElement("th"), { textContent: camera.name, scope: "row" }));
    row.insertCell().textContent = camera.misfit_px.toFixed(1);
    row.insertCell().textContent = camera.misfit_mm.toFixed(0);
    const cell = row.insertCell();
    const lines = mended(camera);
    cell.replaceChildren(...lines.map(({ text, title }) => Object.assign(document.createElement("div"), { textContent: text, title })));
  }
  const used = Object.assign(note(), { textContent: `Frames used: ${found.frames.join(", ")}` });
  return [...notes, table, used];
}

/**
 * @param {CameraCheck} camera
 * @returns {{text: string, title: string}[]}
 */
function mended(camera) {
  if (!camera.is_seen) return [{ text: "shows nobody", title: "Camera without contours of the people on these frames" }];
  if (!camera.kinds.length) return [{ text: "–", title: "Nothing to correct: the misfit is that of the likeliest correction" }];
  const { sigma } = camera;
  /** @type {Record<string, {values: number[], sigma: number[], unit: string, digits: number}>} */
  const of = {
    rotation: { values: camera.rotation_deg, sigma: sigma.rotation_deg, unit: "°", digits: 2 },
    position: { values: camera.position_mm, sigma: sigma.position_mm, unit: "mm", digits: 0 },
    focal: { values: [camera.focal_percent], sigma: sigma.focal_percent, unit: "%", digits: 2 },
    time: { values: [camera.time_ms], sigma: sigma.time_ms, unit: "ms", digits: 1 },
    drift: { values: [camera.drift_ms_per_s], sigma: sigma.drift_ms_per_s, unit: "ms a second", digits: 1 },
  };
  const lines = camera.kinds.map((kind) => {
    const { values, sigma: sigmas, unit, digits } = of[kind];
    const numbers = values.map((value, i) => `${value.toFixed(digits)} ± ${sigmas[i].toFixed(digits)}`);
    return { text: `${WORDS[kind]}: ${numbers.join(", ")} ${unit}`, title: values.length > 1 ? AXES : "" };
  });
  if (camera.since_frame !== null) lines.push({ text: `since frame ${camera.since_frame}`, title: "" });
  if (camera.rivals.length) lines.push({ text: `or ${camera.rivals.map((kind) => WORDS[kind]).join(" or ")}`, title: "Explains the contours as well" });
  return lines;
}

function note() {
  const element = document.createElement("p");
  element.className = "section-note";
  return element;
}

/** @param {string} text */
function capital(text) {
  const end = text.endsWith(".") ? "" : ".";
  return `${text[0].toUpperCase()}${text.slice(1)}${end}`;
}
