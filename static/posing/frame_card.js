/** Card with the status of the current frame, which opens to the cost of each body part. */

import { contradictions, keyframeDoubt } from "../model/keyframe_doubts.js";
import { reasonOf } from "../model/selectors.js";
import { button, byId, make } from "../widgets/elements.js";
import { displayName, px } from "../widgets/text.js";

const STORED_OPEN = "quadrille.parts-open";
/** Cost of a full bar; higher costs look the same. */
const FULL_PX = 6;

/**
 * @param {import("../model/store.js").Store} store
 * @param {import("./posing.js").Posing} posing
 */
export function mountFrameCard(store, posing) {
  const card = byId("frame-card", HTMLDetailsElement);
  const statusBadge = byId("frame-status", HTMLElement);
  const remarkText = byId("frame-remark", HTMLElement);
  const why = byId("show-reason", HTMLButtonElement);
  const parts = byId("frame-parts", HTMLElement);
  const other = button("take-alternative", () => posing.takeAlternative());
  card.open = localStorage.getItem(STORED_OPEN) === "yes";
  card.addEventListener("toggle", () => {
    localStorage.setItem(STORED_OPEN, card.open ? "yes" : "no");
    show();
  });
  store.on(["state", "keyframeDoubts", "reason"], show);

  function show() {
    const { state, session } = store.facts;
    if (!state || !session) return;
    const { status, remark, part_costs_px, person, people } = state;
    other.hidden = !people.some(({ alternatives, shown }) => alternatives > 0 && shown);
    const doubt = keyframeDoubt(store.facts, state.frame, person);
    card.hidden = !doubt && status === "" && part_costs_px.length === 0;
    statusBadge.className = `status-badge is-${doubt ? "doubtful" : status}`;
    statusBadge.textContent = doubt ? "check" : state.is_checked ? "being assessed" : status || "not assessed";
    remarkText.textContent = doubt
      ? `This keyframe disagrees ${contradictions(doubt, session).join("; ")}. Correct it, or accept it.`
      : [remark, reasonOf(store.facts)].filter(Boolean).join(" · ");
    why.hidden = status !== "doubtful" && status !== "lost" && !doubt;
    if (card.hidden || !card.open) return;
    const names = session.people[person].parts;
    const cells = leftBesideRight(names).flatMap((part) => (part === null ? gap() : row(names[part], part_costs_px[part] ?? null)));
    parts.replaceChildren(...(part_costs_px.length ? cells : []));
  }
}

/**
 * Order parts in two columns: the trunk first, then each left part beside the right one. Null is a gap.
 *
 * @param {string[]} names
 */
function leftBesideRight(names) {
  const pairs = names.flatMap((name, left) => {
    const right = name.startsWith("left_") ? names.indexOf(name.replace("left_", "right_")) : -1;
    return right < 0 ? [] : [[left, right]];
  });
  const paired = new Set(pairs.flat());
  const trunk = [...names.keys()].filter((part) => !paired.has(part));
  return [...trunk, ...(trunk.length % 2 ? [null] : []), ...pairs.flat()];
}

/** An empty cell. It is an output element, because every second output ends a row. */
function gap() {
  return [make("output")];
}

/**
 * @param {string} name
 * @param {number | null} cost px; null for a part that is visible in no view
 */
function row(name, cost) {
  const label = make("span", {}, displayName(name));
  const bar = make("i", { "--filled": `${Math.min(100, (100 * (cost ?? 0)) / FULL_PX)}%` });
  return [label, bar, make("output", {}, cost === null ? "not visible" : px(cost))];
}
