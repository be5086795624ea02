/** Transport row above the timeline: playback, current frame, its marks and source, and the legend. */

import { button, byId, make, onChange } from "../widgets/elements.js";
import { clock } from "../widgets/text.js";
import { earlierCalibration, personCells } from "../model/selectors.js";
import { SOURCES, STATUSES as CELL_STATUSES } from "../model/cells.js";
import { opensPopover, togglePopover } from "../widgets/popovers.js";
import { STATUSES, earlierSwatch, sourceSwatch, statusSwatch } from "./cell_marks.js";
import { markSection } from "./mark_list.js";

/**
 * @param {import("../model/store.js").Store} store
 * @param {import("../model/navigation.js").Navigation} navigation
 * @param {import("./playback.js").Playback} playback
 * @param {import("../model/actions.js").Actions} actions
 */
export function mountTransport(store, navigation, playback, actions) {
  const rateField = byId("rate", HTMLSelectElement);
  const frame = byId("frame", HTMLInputElement);
  const total = byId("frame-total", HTMLElement);
  const clockText = byId("clock", HTMLElement);
  const sourceText = byId("source", HTMLElement);
  const legend = byId("legend", HTMLButtonElement);
  button("first-frame", () => navigation.first());
  button("previous-frame", () => navigation.step(-1));
  const play = button("play", () => playback.toggle());
  button("next-frame", () => navigation.step(1));
  button("last-frame", () => navigation.last());
  const loop = button("loop", () => playback.toggleLoop());
  const every = button("every-frame", () => playback.toggleEveryFrame());
  const keyframe = button("toggle-keyframe", () => actions.toggleMark("keyframe"));
  const reviewed = button("toggle-reviewed", () => actions.toggleMark("reviewed"));
  onChange(rateField, () => playback.setRate(Number(rateField.value)));
  frame.addEventListener("focus", () => frame.select());
  frame.addEventListener("change", () => {
    const wanted = frame.valueAsNumber;
    navigation.pause();
    if (Number.isFinite(wanted)) navigation.goTo(wanted);
    frame.value = String(store.facts.target);
  });
  frame.addEventListener("keydown", (event) => {
    if (event.key === "Escape") frame.blur(); // Enter: `leaveFields`
  });
  const marks = byId("marks-panel", HTMLElement);
  marks.append(markSection());
  opensPopover(marks, legend, () => togglePopover(marks, legend));
  store.on(["session"], showSession);
  store.on(["target", "session"], showFrame);
  store.on(["playing"], showPlaying);
  store.on(["rate", "loops", "everyFrame"], showHow);
  store.on(["state", "calibration", "timeline", "lanes", "target", "connected"], showSource);
  store.on(["timeline", "calibration"], showLegend);

  function showSession() {
    const frames = store.facts.session?.n_frames ?? 1;
    frame.max = String(frames - 1);
    total.textContent = `/ ${frames - 1}`;
  }

  function showFrame() {
    const { target, session } = store.facts;
    if (document.activeElement !== frame) frame.value = String(target);
    clockText.textContent = clock(target / (session?.fps ?? 1));
  }

  function showPlaying() {
    const { playing } = store.facts;
    play.setAttribute("aria-label", playing ? "Pause" : "Play");
    play.title = `${playing ? "Pause" : "Play"} (Space)`;
    play.classList.toggle("is-playing", playing);
  }

  function showHow() {
    const { rate, loops, everyFrame } = store.facts;
    rateField.value = String(rate);
    loop.setAttribute("aria-pressed", String(loops));
    every.setAttribute("aria-pressed", String(everyFrame));
  }

  function showSource() {
    const { target, connected, state, session } = store.facts;
    const source = state?.source ?? null;
    const other = state?.other_sizes ?? false;
    const isOutdated = !!state && !!earlierCalibration(store.facts)[state.person]?.has(state.frame);
    const name = session && session.people.length > 1 && state ? session.people[state.person].name : "";
    const what = state?.replay ? "replay" : `${source}${other ? ", earlier sizes" : ""}${isOutdated ? ", earlier calibration" : ""}`;
    sourceText.textContent = source === null && !state?.replay ? `${name && `${name}: `}No pose` : `${name || "Pose"}: ${what}`;
    const converted = "Track again to use the present ones; a keyframe is refitted by Body sizes, Apply, in the inspector";
    const made = `This pose was made with earlier body sizes and is shown with them. ${converted}`;
    const stale = "This pose was made before the cameras were corrected. Track it again in the inspector, section Calibration";
    sourceText.title = other ? made : isOutdated ? stale : `Source of the pose${name && ` of ${name}`}, as stored: the most manual one of its values`;
    const cell = personCells(store.facts).get(target);
    keyframe.disabled = !connected || !state;
    reviewed.disabled = !connected || !cell || cell.keyframe;
    keyframe.setAttribute("aria-pressed", String(!!cell?.keyframe));
    reviewed.setAttribute("aria-pressed", String(!!cell?.reviewed));
  }

  function showLegend() {
    const { timeline } = store.facts;
    const sources = new Set(SOURCES.filter((_, index) => timeline.sources.includes(index)));
    const statuses = new Set(CELL_STATUSES.filter((_, index) => timeline.statuses.includes(index)));
    const shown = STATUSES.filter((status) => statuses.has(status));
    const earlier = earlierCalibration(store.facts).some(({ size }) => size) ? ["earlier calibration"] : [];
    const rows = [
      [...shown.map((status) => entry(status, statusSwatch(status))), ...earlier.map((text) => entry(text, earlierSwatch()))],
      SOURCES.filter((source) => sources.has(source)).map((source) => entry(source, sourceSwatch(source))),
    ];
    legend.title = `${[...shown, ...earlier, ...sources].join(", ")}. Click for all marks and lines`;
    legend.replaceChildren(...rows.map((swatches) => make("span", "legend-row", ...swatches)));
  }
}

/**
 * @param {string} text
 * @param {HTMLElement} mark
 */
function entry(text, mark) {
  return make("span", {}, mark, text);
}
