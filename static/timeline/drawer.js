/** Drawer above the timeline with tabs for curves, search, cost landscape and doubtful poses. Its height and tab are stored. */

import { button, byId } from "../widgets/elements.js";
import { makeSeparator, showPosition } from "../widgets/separator.js";

/** @type {readonly import("../model/protocol.js").CurveGroup[]} */
export const CURVE_GROUPS = ["arms", "torso", "legs", "cost"];

const STORED_OPEN = "quadrille.drawer-open";
const STORED_TAB = "quadrille.drawer-tab";
const STORED_CURVES = "quadrille.drawer-curves";
const STORED_HEIGHT = "quadrille.drawer-height-";
/** Height below the tabs: default fraction of the window, and minimum in CSS pixels. */
const DEFAULT_SHARES = { curves: 0.21, search: 0.3, doubts: 0.2 };
const MIN_PX = 140;
/** Minimum height of the rest of the window, CSS pixels. */
const PANES_PX = 340;

export class Drawer {
  #store;
  #panel = byId("drawer", HTMLElement);
  #stage = byId("drawer-stage", HTMLElement);
  #grip = byId("drawer-grip", HTMLElement);
  #tabs = /** @type {HTMLInputElement[]} */ ([...document.querySelectorAll("input[name=drawer]")]);
  #toggle;

  /** @param {import("../model/store.js").Store} store */
  constructor(store) {
    this.#store = store;
    this.#toggle = button("show-curves", () => this.#open(this.#isOpen ? null : this.#lastTab));
    button("close-drawer", () => this.#open(null));
    for (const tab of this.#tabs) {
      tab.addEventListener("change", () => {
        this.#open(/** @type {import("../model/series.js").Tab} */ (tab.value));
        tab.blur();
      });
    }
    makeSeparator(this.#grip, {
      position: () => -this.#stage.clientHeight,
      moveTo: (position) => this.#resize(-position),
      reset: () => this.#resize(null),
    });
    addEventListener("resize", () => this.#fit());
    this.#open(localStorage.getItem(STORED_OPEN) === "yes" ? this.#lastTab : null);
  }

  /**
   * Open a tab, or close the drawer if that tab is open.
   *
   * @param {import("../model/series.js").Tab} tab
   */
  toggle(tab) {
    this.#open(this.#store.facts.drawer === tab ? null : tab);
  }

  /** @param {import("../model/series.js").Tab} tab */
  open(tab) {
    this.#open(tab);
  }

  /** Open the last group of curves, or close the drawer if curves are shown. */
  toggleCurves() {
    const stored = localStorage.getItem(STORED_CURVES);
    const isShown = CURVE_GROUPS.some((group) => group === this.#store.facts.drawer);
    this.#open(isShown ? null : (CURVE_GROUPS.find((group) => group === stored) ?? "arms"));
  }

  get #isOpen() {
    return this.#store.facts.drawer !== null;
  }

  get #lastTab() {
    const stored = localStorage.getItem(STORED_TAB);
    return /** @type {import("../model/series.js").Tab} */ (this.#tabs.find(({ value }) => value === stored)?.value ?? "arms");
  }

  /** @param {import("../model/series.js").Tab | null} tab */
  #open(tab) {
    localStorage.setItem(STORED_OPEN, tab === null ? "no" : "yes");
    if (tab !== null) localStorage.setItem(STORED_TAB, tab);
    if (CURVE_GROUPS.some((group) => group === tab)) localStorage.setItem(STORED_CURVES, String(tab));
    this.#panel.hidden = tab === null;
    this.#toggle.setAttribute("aria-pressed", String(tab !== null));
    for (const one of this.#tabs) one.checked = one.value === tab;
    this.#store.set({ drawer: tab });
    this.#fit();
  }

  /** Curves and thumbnails need less height than the search, so each kind has its own. */
  get #kind() {
    const { drawer } = this.#store.facts;
    if (drawer === "doubts") return "doubts";
    return CURVE_GROUPS.some((group) => group === drawer) ? "curves" : "search";
  }

  /** Apply the stored height, as far as the window has room for it. */
  #fit() {
    const max = Math.max(MIN_PX, innerHeight - PANES_PX);
    const chosen = Number(localStorage.getItem(STORED_HEIGHT + this.#kind)) || DEFAULT_SHARES[this.#kind] * innerHeight;
    const height = Math.round(Math.max(MIN_PX, Math.min(max, chosen)));
    this.#stage.style.height = `${height}px`;
    showPosition(this.#grip, { now: height, min: MIN_PX, max });
  }

  /** @param {number | null} height null for the default */
  #resize(height) {
    localStorage.setItem(STORED_HEIGHT + this.#kind, height === null ? "" : String(Math.max(MIN_PX, Math.round(height))));
    this.#fit();
  }
}
