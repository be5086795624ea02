/** Announce changes in a live region for screen readers. */

import { displayName } from "../widgets/text.js";

const SETTLED_MS = 400;

/**
 * @param {HTMLElement} region
 * @param {import("../model/store.js").Store} store
 */
export function mountAnnouncer(region, store) {
  /** @type {import("../model/protocol.js").StateMessage | null} what was last announced */
  let announced = null;
  let timer = 0;
  store.on(["state"], () => {
    announced ??= store.facts.state;
    clearTimeout(timer);
    // Wait until a sequence of changes has ended.
    timer = setTimeout(() => announce(), SETTLED_MS);
  });

  function announce() {
    const { state, session, playing, dragging } = store.facts;
    if (!state || playing || dragging || state.track.running) return;
    const before = announced ?? state;
    announced = state;
    const words = [];
    if (state.person !== before.person) words.push(session?.people[state.person]?.name ?? "");
    if (state.point !== before.point && state.point) words.push(`${displayName(state.point)} selected`);
    if (state.undo !== before.undo || state.redo !== before.redo) {
      words.push(state.redo !== null && state.redo !== before.redo ? `undone: ${state.redo}` : (state.undo ?? "nothing to undo"));
    }
    if (state.frame !== before.frame) {
      words.push(`frame ${state.frame}, ${[state.source ?? "no pose", state.status].filter(Boolean).join(", ")}`);
    }
    if (words.length) region.textContent = `${words.join("; ")}.`;
  }
}
