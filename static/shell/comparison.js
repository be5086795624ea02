/** Before and after of the last fit or search: costs in the top bar and for each view, and a switch between the poses. */

import { button, byId, make } from "../widgets/elements.js";
import { opensPopover, togglePopover } from "../widgets/popovers.js";
import { px } from "../widgets/text.js";

/** Smallest change that is listed with its direction, in pixels: as much as is displayed. */
const LEAST_PX = 0.005;

export class Comparison {
  #store;
  #before = byId("show-comparison", HTMLButtonElement);
  #toggle;
  #toggleHere;
  #cost = /** @type {HTMLElement} */ (document.querySelector(".cost"));
  #badge = byId("before-badge", HTMLElement);
  #panel = byId("comparison-panel", HTMLElement);
  #title = byId("comparison-title", HTMLElement);
  #views = byId("comparison-views", HTMLElement);
  #warning = byId("comparison-warning", HTMLElement);

  /**
   * @param {import("../model/store.js").Store} store
   * @param {import("../model/actions.js").Actions} actions
   */
  constructor(store, actions) {
    this.#store = store;
    this.#toggle = button("toggle-before", () => actions.toggleBefore());
    this.#toggleHere = button("toggle-before-here", () => actions.toggleBefore());
    opensPopover(this.#panel, this.#before, () => togglePopover(this.#panel, this.#cost));
    store.on(["state", "connected"], () => this.#show());
  }

  #show() {
    const { state, connected } = this.#store.facts;
    const last = state?.compared ?? null;
    const isBefore = !!last?.is_before_shown && !state?.replay;
    this.#before.hidden = this.#toggle.hidden = !last;
    this.#toggle.disabled = this.#toggleHere.disabled = !connected;
    this.#toggle.setAttribute("aria-pressed", String(isBefore));
    this.#badge.hidden = !isBefore;
    if (!state || !last) {
      if (this.#panel.matches(":popover-open")) this.#panel.hidePopover();
      return;
    }
    const was = last.before_px?.toFixed(2) ?? "–";
    this.#before.textContent = isBefore ? "before" : `${was} →`;
    this.#before.classList.toggle("is-warned", last.warning !== "");
    this.#before.title = `Cost before and after the ${last.work}: ${costs(last.before_px, last.after_px)}. Click for each view`;
    this.#badge.textContent = `Before the ${last.work}: ${px(last.before_px)} · Shift+B shows the result`;
    const label = isBefore ? `Show the result of the ${last.work}` : `Show the pose before the ${last.work}`;
    this.#toggle.title = this.#toggleHere.title = `${label} (Shift+B)`;
    this.#toggleHere.textContent = isBefore ? "Show result" : "Show before";
    this.#toggle.setAttribute("aria-label", label);
    this.#list(last);
  }

  /** @param {import("../model/protocol.js").Compared} last */
  #list(last) {
    const { session } = this.#store.facts;
    this.#title.textContent = `Cost before and after the ${last.work}`;
    const names = session?.cameras.map(({ name }) => name) ?? [];
    this.#views.replaceChildren(
      ...names.map((name, i) => row(name, last.before_view_costs_px[i] ?? null, last.after_view_costs_px[i] ?? null)),
      row("Mean", last.before_px, last.after_px),
    );
    this.#warning.hidden = last.warning === "";
    this.#warning.textContent = last.warning;
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
  const line = make("tr");
  const head = make("th", { scope: "row" }, name);
  const change = before === null || after === null ? null : after - before;
  const isRise = change !== null && change > LEAST_PX;
  const sign = change === null ? "" : isRise ? "▲ +" : change < -LEAST_PX ? "▼ −" : "";
  const cells = [before?.toFixed(2) ?? "–", after?.toFixed(2) ?? "–", change === null ? "" : `${sign}${Math.abs(change).toFixed(2)}`];
  line.append(
    head,
    ...cells.map((text) => make("td", {}, text)),
  );
  line.classList.toggle("is-rise", isRise);
  return line;
}
