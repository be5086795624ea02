/** Comments: written at the selected limb, listed, gone to, and resolved. */

import { frameRow } from "../inspector/parts.js";
import { make, textButton } from "../widgets/elements.js";
import { lineForm } from "./parts.js";

/** @typedef {import("../model/protocol.js").CommentInfo} Comment */

/**
 * @param {import("../model/index.js").Context} context
 * @param {import("./review.js").Review} review
 * @param {import("./visits.js").Visits} visits
 */
export function commentList({ store, send }, review, visits) {
  /** Index of the limb of the selected point; null for the whole body. */
  const limbHere = () => {
    const { state, session } = store.facts;
    const info = state && session?.people[state.person];
    const index = state?.point ? (info?.limbs.indexOf(info.point_limbs[state.point]?.name) ?? -1) : -1;
    return index < 0 ? null : index;
  };
  const place = () => {
    const { person, frame } = review.here();
    const people = store.facts.session?.people ?? [];
    const limb = limbHere();
    const words = [people.length > 1 ? people[person]?.name : "", limb === null ? "whole body" : people[person]?.limbs[limb], `frame ${frame}`];
    return words.filter(Boolean).join(", ");
  };
  const line = lineForm("Comment", "Comment", (text) => send({ type: "annotation", action: "comment", ...review.here(), limb: limbHere(), text }));
  const list = make("ul", "plan-comments");
  const resolved = textButton("Show resolved", "List resolved comments too (toggle)", () => {
    showsResolved = !showsResolved;
    show();
  });
  let showsResolved = false;

  const entry = (/** @type {Comment} */ comment) => {
    const people = store.facts.session?.people ?? [];
    const where = [people.length > 1 ? people[comment.person]?.name : "", comment.limb].filter(Boolean).join(", ");
    const words = make("span", {}, `${where ? `${where}: ` : ""}${comment.text}`, make("span", "quiet", comment.author ? ` ${comment.author}` : ""));
    const row = frameRow(comment.frame, false, `Go to frame ${comment.frame}`, () => visits.go(comment), words);
    row.classList.toggle("is-resolved", comment.resolved);
    const done = textButton(comment.resolved ? "Reopen" : "Resolve", comment.resolved ? "Open this comment again" : "This comment is done", () =>
      send({ type: "annotation", action: comment.resolved ? "reopen" : "resolve", uid: comment.uid }), { "data-no-command": "" }
    );
    row.append(done);
    return row;
  };

  const showPlace = () => {
    line.input.placeholder = `On ${place()}`;
  };
  const show = () => {
    const all = store.facts.annotation?.comments ?? [];
    const found = all.filter((comment) => showsResolved || !comment.resolved);
    list.replaceChildren(...[...found].sort((a, b) => a.frame - b.frame).map(entry));
    list.hidden = found.length === 0;
    line.offer(all.map((comment) => comment.text));
    resolved.hidden = !all.some((comment) => comment.resolved);
    resolved.setAttribute("aria-pressed", String(showsResolved));
    showPlace();
  };

  return { elements: [line.form, list, resolved], input: line.input, show, showPlace };
}
