/** Before and after of the last fit or search: costs in the top bar and for each view, and a switch between the poses. */

import { button, byId, tableRow } from "../widgets/elements.js";
import { opensPopover, togglePopover } from "../widgets/popovers.js";
import { px } from "../widgets/text.js";

/** Smallest change that is listed with its direction, in pixels: as much as is displayed. */
const LEAST_PX = 0.005;

/**
 * @param {import("../model/store.js").Store} store
 * @param {import("../model/actions.js").Actions} actions
 */
export function mountComparison(store, actions) {
  const beforeButton = byId("show-comparison", HTMLButtonElement);
  const cost = /** @type {HTMLElement} */ (document.querySelector(".cost"));
  const badge = byId("before-badge", HTMLElement);
  const panel = byId("comparison-panel", HTMLElement);
  const title = byId("comparison-title", HTMLElement);
  const views = byId("comparison-views", HTMLElement);
  const warning = byId("comparison-warning", HTMLElement);
  const toggle = button("toggle-before", () => actions.toggleBefore());
  const toggleHere = button("toggle-before-here", () => actions.toggleBefore());
  opensPopover(panel, beforeButton, () => togglePopover(panel, cost));
  store.on(["state", "connected"], show);

  function show() {
    const { state, connected } = store.facts;
    const last = state?.compared ?? null;
    const isBefore = !!last?.is_before_shown && !state?.replay;
    beforeButton.hidden = toggle.hidden = !last;
    toggle.disabled = toggleHere.disabled = !connected;
    toggle.setAttribute("aria-pressed", String(isBefore));
    badge.hidden = !isBefore;
    if (!state || !last) {
      if (panel.matches(":popover-open")) panel.hidePopover();
      return;
    }
    beforeButton.textContent = isBefore ? "before" : `${last.before_px?.toFixed(2) ?? "–"} →`;
    beforeButton.classList.toggle("is-warned", last.warning !== "");
    beforeButton.title = `Cost before and after the ${last.work}: ${costs(last.before_px, last.after_px)}. Click for each view`;
    badge.textContent = `Before the ${last.work}: ${px(last.before_px)}`;
    const label = isBefore ? `Show the result of the ${last.work}` : `Show the pose before the ${last.work}`;
    toggle.title = toggleHere.title = label;
    toggleHere.textContent = isBefore ? "Show result" : "Show before";
    toggle.setAttribute("aria-label", label);
    list(last);
  }

  /** @param {import("../model/protocol.js").Compared} last */
  function list(last) {
    const { session } = store.facts;
    title.textContent = `Cost before and after the ${last.work}`;
    const names = session?.cameras.map(({ name }) => name) ?? [];
    views.replaceChildren(
      ...names.map((name, i) => row(name, last.before_view_costs_px[i] ?? null, last.after_view_costs_px[i] ?? null)),
      row("Mean", last.before_px, last.after_px),
    );
    warning.hidden = last.warning === "";
    warning.textContent = last.warning;
  }
}

/**
 * @param {number | null} before
 * @param {number | null} after
 */
function costs(before, after) {
  return `${before?.toFixed(2) ?? "–"} → ${px(after)}`;
}

/**
 * @param {string} name
 * @param {number | null} before
 * @param {number | null} after
 */
function row(name, before, after) {
  const change = before === null || after === null ? null : after - before;
  const isRise = change !== null && change > LEAST_PX;
  const sign = change === null ? "" : isRise ? "▲ +" : change < -LEAST_PX ? "▼ −" : "";
  const cells = [before?.toFixed(2) ?? "–", after?.toFixed(2) ?? "–", change === null ? "" : `${sign}${Math.abs(change).toFixed(2)}`];
  const line = tableRow(name, cells);
  line.classList.toggle("is-rise", isRise);
  return line;
}
