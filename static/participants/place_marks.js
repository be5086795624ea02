/** Marks along the timeline at the frames of the others. */

import { FrameAxis } from "../widgets/frame_axis.js";
import { colorOf, initialsOf, nameOf } from "./marks.js";

export class PlaceMarks {
  #timeline;
  #store;
  #layer = Object.assign(document.createElement("div"), { className: "place-marks" });

  /**
   * @param {HTMLElement} timeline
   * @param {import("../model/store.js").Store} store
   */
  constructor(timeline, store) {
    this.#timeline = timeline;
    this.#store = store;
    this.#layer.setAttribute("aria-hidden", "true"); // the list of people says the same
    timeline.append(this.#layer);
    new ResizeObserver(() => this.#show()).observe(timeline);
    store.subscribe((changed) => {
      if (["presence", "session", "visible"].some((fact) => changed.has(/** @type {"presence"} */ (fact)))) this.#show();
    });
  }

  #show() {
    const { presence, session, visible } = this.#store.facts;
    const axis = new FrameAxis(this.#timeline.clientWidth, session?.n_frames ?? 1, visible);
    const others = (presence?.people ?? []).map((person, index) => ({ person, index })).filter(({ person }) => !person.is_self);
    const marks = others.filter(({ person }) => axis.shows(person.frame)).map(({ person, index }) => {
      const mark = Object.assign(document.createElement("span"), { className: "place-mark", textContent: initialsOf(person) });
      mark.title = `${nameOf(person)} is on frame ${person.frame}`;
      mark.style.left = `${axis.middle(person.frame)}px`;
      mark.style.setProperty("--participant", colorOf(index));
      return mark;
    }); // prettier-ignore
    this.#layer.replaceChildren(...marks);
  }
}
