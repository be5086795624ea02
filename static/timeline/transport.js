/** Transport row above the timeline: playback, current frame, its marks and source, and the legend. */

import { button, byId, make, onChange } from "../widgets/elements.js";
import { clock } from "../widgets/text.js";
import { earlierCalibration, personCells } from "../model/selectors.js";
import { SOURCES, STATUSES as CELL_STATUSES } from "../model/cells.js";
import { opensPopover, togglePopover } from "../widgets/popovers.js";
import { STATUSES, earlierSwatch, sourceSwatch, statusSwatch } from "./cell_marks.js";
import { markSection } from "./mark_list.js";

export class Transport {
  #store;
  #play;
  #loop;
  #every;
  #keyframe;
  #reviewed;
  #rate = byId("rate", HTMLSelectElement);
  #frame = byId("frame", HTMLInputElement);
  #total = byId("frame-total", HTMLElement);
  #clock = byId("clock", HTMLElement);
  #source = byId("source", HTMLElement);
  #legend = byId("legend", HTMLButtonElement);

  /**
   * @param {import("../model/store.js").Store} store
   * @param {import("../model/navigation.js").Navigation} navigation
   * @param {import("./playback.js").Playback} playback
   * @param {import("../model/actions.js").Actions} actions
   */
  constructor(store, navigation, playback, actions) {
    this.#store = store;
    button("first-frame", () => navigation.first());
    button("previous-frame", () => navigation.step(-1));
    this.#play = button("play", () => playback.toggle());
    button("next-frame", () => navigation.step(1));
    button("last-frame", () => navigation.last());
    this.#loop = button("loop", () => playback.toggleLoop());
    this.#every = button("every-frame", () => playback.toggleEveryFrame());
    this.#keyframe = button("toggle-keyframe", () => actions.toggleMark("keyframe"));
    this.#reviewed = button("toggle-reviewed", () => actions.toggleMark("reviewed"));
    onChange(this.#rate, () => playback.setRate(Number(this.#rate.value)));
    this.#frame.addEventListener("focus", () => this.#frame.select());
    this.#frame.addEventListener("change", () => {
      const wanted = this.#frame.valueAsNumber;
      navigation.pause();
      if (Number.isFinite(wanted)) navigation.goTo(wanted);
      this.#frame.value = String(this.#store.facts.target);
    });
    this.#frame.addEventListener("keydown", (event) => {
      if (event.key === "Escape") this.#frame.blur(); // Enter: `leaveFields`
    });
    const marks = byId("marks-panel", HTMLElement);
    marks.append(markSection());
    opensPopover(marks, this.#legend, () => togglePopover(marks, this.#legend));
    store.on(["session"], () => this.#showSession());
    store.on(["target", "session"], () => this.#showFrame());
    store.on(["playing"], () => this.#showPlaying());
    store.on(["rate", "loops", "everyFrame"], () => this.#showHow());
    store.on(["state", "calibration", "timeline", "lanes", "target", "connected"], () => this.#showSource());
    store.on(["timeline", "calibration"], () => this.#showLegend());
  }

  #showSession() {
    const frames = this.#store.facts.session?.n_frames ?? 1;
    this.#frame.max = String(frames - 1);
    this.#total.textContent = `/ ${frames - 1}`;
  }

  #showFrame() {
    const { target, session } = this.#store.facts;
    if (document.activeElement !== this.#frame) this.#frame.value = String(target);
    this.#clock.textContent = clock(target / (session?.fps ?? 1));
  }

  #showPlaying() {
    const { playing } = this.#store.facts;
    this.#play.setAttribute("aria-label", playing ? "Pause" : "Play");
    this.#play.title = `${playing ? "Pause" : "Play"} (Space)`;
    this.#play.classList.toggle("is-playing", playing);
  }

  #showHow() {
    const { rate, loops, everyFrame } = this.#store.facts;
    this.#rate.value = String(rate);
    this.#loop.setAttribute("aria-pressed", String(loops));
    this.#every.setAttribute("aria-pressed", String(everyFrame));
  }

  #showSource() {
    const { target, connected, state, session } = this.#store.facts;
    const source = state?.source ?? null;
    const other = state?.other_sizes ?? false;
    const isOutdated = !!state && !!earlierCalibration(this.#store.facts)[state.person]?.has(state.frame);
    const name = session && session.people.length > 1 && state ? session.people[state.person].name : "";
    const what = state?.replay ? "replay" : `${source}${other ? ", earlier sizes" : ""}${isOutdated ? ", earlier calibration" : ""}`;
    this.#source.textContent = source === null && !state?.replay ? `${name && `${name}: `}No pose` : `${name || "Pose"}: ${what}`;
    const converted = "Track again to use the present ones; a keyframe is refitted by Body sizes, Apply, in the inspector";
    const made = `This pose was made with earlier body sizes and is shown with them. ${converted}`;
    const stale = "This pose was made before the cameras were corrected. Track it again in the inspector, section Calibration";
    this.#source.title = other ? made : isOutdated ? stale : `Source of the pose${name && ` of ${name}`}, as stored: the most manual one of its values`;
    const cell = personCells(this.#store.facts).get(target);
    this.#keyframe.disabled = !connected || !state;
    this.#reviewed.disabled = !connected || !cell || cell.keyframe;
    this.#keyframe.setAttribute("aria-pressed", String(!!cell?.keyframe));
    this.#reviewed.setAttribute("aria-pressed", String(!!cell?.reviewed));
  }

  #showLegend() {
    const { timeline } = this.#store.facts;
    const sources = new Set(SOURCES.filter((_, index) => timeline.sources.includes(index)));
    const statuses = new Set(CELL_STATUSES.filter((_, index) => timeline.statuses.includes(index)));
    const shown = STATUSES.filter((status) => statuses.has(status));
    const earlier = earlierCalibration(this.#store.facts).some(({ size }) => size) ? ["earlier calibration"] : [];
    const rows = [
      [...shown.map((status) => entry(status, statusSwatch(status))), ...earlier.map((text) => entry(text, earlierSwatch()))],
      SOURCES.filter((source) => sources.has(source)).map((source) => entry(source, sourceSwatch(source))),
    ];
    this.#legend.title = `${[...shown, ...earlier, ...sources].join(", ")}. Click for all marks and lines`;
    this.#legend.replaceChildren(...rows.map((swatches) => make("span", "legend-row", ...swatches)));
  }
}

/**
 * @param {string} text
 * @param {HTMLElement} mark
 */
function entry(text, mark) {
  return make("span", {}, mark, text);
}
