/**
 * Participants: who else is on the session, where, and the name by which this page joins.
 *
 * The room imports `widgets` and types of `model`.
 */

import { byId } from "../widgets/elements.js";
import { inArea } from "../widgets/key_matching.js";
import { mountHere } from "./here.js";
import { joinForm } from "./join_form.js";
import { mountPlaceMarks } from "./place_marks.js";
import { showRole } from "./role_badge.js";

/** @typedef {ReturnType<typeof mount>} ParticipantsRoom */

/**
 * Show who is where in the top bar and along the timeline.
 *
 * @param {import("../model/index.js").Context} context
 */
export function mount(context) {
  showRole(context.store);
  const here = mountHere(context, joinForm(context, "panel"));
  mountPlaceMarks(byId("timeline", HTMLElement), context.store);
  const bar = byId("join-bar", HTMLElement);
  bar.append(joinForm(context, "bar").form);
  context.store.on(["presence", "session"], () => {
    const { presence, session } = context.store.facts;
    bar.hidden = !presence || !session || session.has_place;
    document.documentElement.dataset.place = String(session?.has_place ?? true);
  });
  return { bindings: inArea("People", [{ label: "People on this session, and your name", words: "join participants", run: () => here.toggle() }]) };
}
