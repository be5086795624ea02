/** Say what a shared link allows; styles/role.css hides the controls that it does not. */

import { byId } from "../widgets/elements.js";

const TEXTS = {
  annotate: ["Annotate", "Your own frame and undo. The host's page changes bodies, cameras, the floor and the 3-D view"],
  look: ["Look only", "This page shows the session. It changes nothing"],
  review: ["Review", "This page marks poses as reviewed, verifies and rejects tasks. It changes no pose"],
};

/** @param {import("../model/store.js").Store} store */
export function showRole(store) {
  const badge = byId("role-badge", HTMLElement);
  store.on(["session"], () => {
    const role = store.facts.session?.role;
    if (!role) return;
    document.documentElement.dataset.role = role;
    badge.hidden = role === "host";
    if (role !== "host") [badge.textContent, badge.title] = TEXTS[role];
  });
}
