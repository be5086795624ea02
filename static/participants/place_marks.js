/** Marks along the timeline at the frames of the others. */

import { make } from "../widgets/elements.js";
import { FrameAxis } from "../widgets/frame_axis.js";
import { colorOf, initialsOf, nameOf } from "./marks.js";

/** Marks nearer than this stand one below the other. */
const WIDTH_PX = 22;
/** Distance of one below the other, and the number of steps at most: the timeline has no more room. */
const [STEP_PX, MAX_STEPS] = [13, 2];

/**
 * @param {HTMLElement} timeline
 * @param {import("../model/store.js").Store} store
 */
export function mountPlaceMarks(timeline, store) {
  const layer = make("div", { className: "place-marks", "aria-hidden": "true" }); // the list of people says the same
  timeline.append(layer);
  new ResizeObserver(() => show()).observe(timeline);
  store.on(["presence", "session", "visible"], show);

  function show() {
    const { presence, session, visible } = store.facts;
    const axis = new FrameAxis(timeline.clientWidth, session?.n_frames ?? 1, visible);
    const others = (presence?.people ?? []).map((person, index) => ({ person, index })).filter(({ person }) => !person.is_self);
    const shown = others.filter(({ person }) => axis.shows(person.frame));
    const marks = shown.map(({ person, index }, at) => {
      const before = shown.slice(0, at).filter((one) => Math.abs(axis.middle(one.person.frame) - axis.middle(person.frame)) < WIDTH_PX);
      const properties = { className: "place-mark", title: `${nameOf(person)} is on frame ${person.frame}`, "--participant": colorOf(index) };
      const mark = make("span", properties, initialsOf(person));
      mark.style.left = `${axis.middle(person.frame)}px`;
      mark.style.top = `${2 + STEP_PX * Math.min(before.length, MAX_STEPS)}px`;
      return mark;
    }); // prettier-ignore
    layer.replaceChildren(...marks);
  }
}
