/** Say what a shared link allows; styles/role.css hides the controls that it does not. */

import { byId } from "../widgets/elements.js";

const TEXTS = {
  look: ["Look only", "This link shows the session and the frame that the annotator works on. It changes nothing"],
  review: ["Review", "This link shows the session and marks poses as reviewed (E). It changes no pose"],
};

/** @param {import("../model/store.js").Store} store */
export function showRole(store) {
  const badge = byId("role-badge", HTMLElement);
  store.subscribe((changed) => {
    const role = store.facts.session?.role;
    if (!changed.has("session") || !role) return;
    document.documentElement.dataset.role = role;
    badge.hidden = role === "annotate";
    if (role !== "annotate") [badge.textContent, badge.title] = TEXTS[role];
  });
}
