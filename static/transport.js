/** The row above the timeline: where the recording stands, how to move it, and what the colours mean. */

import { button, byId } from "./elements.js";
import { clock } from "./text.js";
import { SOURCES } from "./timeline.js";
import { STATUSES } from "./timeline_drawing.js";

export class Transport {
  #store;
  #play;
  #frame = byId("frame", HTMLInputElement);
  #total = byId("frame-total", HTMLElement);
  #clock = byId("clock", HTMLElement);
  #source = byId("source", HTMLElement);
  #legend = byId("legend", HTMLElement);

  /**
   * @param {import("./store.js").Store} store
   * @param {import("./navigation.js").Navigation} navigation
   */
  constructor(store, navigation) {
    this.#store = store;
    button("first-frame", () => navigation.first());
    button("previous-frame", () => navigation.step(-1));
    this.#play = button("play", () => navigation.togglePlay());
    button("next-frame", () => navigation.step(1));
    button("last-frame", () => navigation.last());
    this.#frame.addEventListener("focus", () => this.#frame.select());
    this.#frame.addEventListener("change", () => {
      const wanted = this.#frame.valueAsNumber;
      navigation.pause();
      if (Number.isFinite(wanted)) navigation.goTo(wanted);
      this.#frame.value = String(this.#store.facts.target);
    });
    this.#frame.addEventListener("keydown", (event) => {
      if (event.key === "Enter" || event.key === "Escape") this.#frame.blur();
    });
    store.subscribe((changed) => {
      if (changed.has("session")) this.#showSession();
      if (changed.has("target") || changed.has("session")) this.#showFrame();
      if (changed.has("playing")) this.#showPlaying();
      if (changed.has("state")) this.#showSource();
      if (changed.has("timeline")) this.#showLegend();
    });
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

  #showSource() {
    const source = this.#store.facts.state?.source ?? null;
    this.#source.textContent = source === null ? "No pose yet" : `Pose: ${source}`;
  }

  #showLegend() {
    const cells = [...this.#store.facts.timeline.values()];
    const sources = new Set(cells.map(({ source }) => source));
    const statuses = new Set(cells.map(({ status }) => status));
    const rows = [
      STATUSES.filter((status) => statuses.has(status)).map((status) => swatch(status, `--status-${status}`, status)),
      SOURCES.filter((source) => sources.has(source)).map((source) => swatch(source, `--source-${source}`, "")),
    ];
    this.#legend.replaceChildren(
      ...rows.map((swatches) => {
        const row = document.createElement("div");
        row.append(...swatches);
        return row;
      }),
    );
  }
}

/**
 * @param {string} text
 * @param {string} color name of the style's colour
 * @param {string} kind class of the mark, which gives it its shape
 */
function swatch(text, color, kind) {
  const item = document.createElement("span");
  const mark = document.createElement("i");
  mark.style.background = `var(${color})`;
  if (kind) mark.className = `is-${kind}`;
  item.append(mark, text);
  return item;
}
