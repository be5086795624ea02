/**
 * Drawer above the timeline with tabs for curves, search, cost landscape and doubtful poses. Its height is stored, and for
 * each session whether it is open. A drawer that lost its content closes, and an empty one is not opened again by itself.
 */

import { keep, kept } from "../layout/kept_views.js";
import { hasSearch } from "../model/selectors.js";
import { listDoubts } from "./doubts.js";
import { button, byId, onChange } from "../widgets/elements.js";
import { makeSeparator, showPosition } from "../widgets/separator.js";

/** @type {readonly import("../model/protocol.js").CurveGroup[]} */
export const CURVE_GROUPS = ["arms", "torso", "legs", "cost"];

const STORED_TAB = "quadrille.drawer-tab";
const STORED_CURVES = "quadrille.drawer-curves";
const STORED_HEIGHT = "quadrille.drawer-height-";
/** Height below the tabs: default fraction of the window, and minimum in CSS pixels. */
const DEFAULT_SHARES = { curves: 0.21, search: 0.3, doubts: 0.2 };
const MIN_PX = 140;
/** Height that a drawer leaves to the views where it can, by default and at least; and its own least height, CSS pixels. */
const [VIEWS_PX, LEAST_VIEWS_PX, LEAST_PX] = [200, 100, 60];

/** @typedef {import("../model/series.js").Tab} Tab */

export class Drawer {
  #store;
  #session = "";
  /** @type {Tab | null} tab to open once it is known to have content */
  #pending = null;
  /** Whether the open tab has had content, or must have some to stay open. */
  #needsContent = false;
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
      onChange(tab, () => this.#open(/** @type {import("../model/series.js").Tab} */ (tab.value)));
    }
    makeSeparator(this.#grip, {
      position: () => -this.#stage.clientHeight,
      moveTo: (position) => this.#resize(-position),
      reset: () => this.#resize(null),
    });
    addEventListener("resize", () => this.#fit());
    const heights = new ResizeObserver(() => this.#fit());
    for (const bar of [...barsAround(), byId("timeline", HTMLElement)]) heights.observe(bar);
    this.#show(null);
    store.on(["session"], () => this.#begin());
    store.on(["timeline"], () => this.#pending && !isEmpty(store.facts, this.#pending) && this.#restore(this.#pending));
    store.on(["timeline", "lanes", "searchRuns", "rangeComparison", "state"], () => this.#check());
  }

  /** Close the drawer in another session; open it there if it was open and has content. */
  #begin() {
    const name = this.#store.facts.session?.name ?? "";
    if (name === this.#session) return;
    this.#session = name;
    const tab = kept("drawer", name);
    this.#show(null);
    this.#pending = this.#tabs.some(({ value }) => value === tab) ? /** @type {Tab} */ (tab) : null;
  }

  /** @param {Tab} tab */
  #restore(tab) {
    this.#show(tab);
    this.#needsContent = tab !== "doubts";
  }

  /** Close the drawer if its content is gone. A receipt of resolved doubts stays. */
  #check() {
    const { facts } = this.#store;
    const { drawer, connected } = facts;
    if (drawer === null || drawer === "doubts" || !connected || facts.session?.name !== this.#session) return;
    if (drawer === "search" && !facts.searchRuns) return; // not known before the drawer has been open for a while
    if (!isEmpty(facts, drawer)) this.#needsContent = true;
    else if (this.#needsContent) this.#open(null);
  }

  /**
   * Open a tab, or close the drawer if that tab is open.
   *
   * @param {Tab} tab
   */
  toggle(tab) {
    this.#open(this.#store.facts.drawer === tab ? null : tab);
  }

  /** @param {Tab} tab */
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

  /** @param {Tab | null} tab */
  #open(tab) {
    keep("drawer", this.#session, tab);
    this.#show(tab);
    this.#check();
  }

  /** @param {Tab | null} tab */
  #show(tab) {
    this.#pending = null;
    this.#needsContent = false;
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
    const bars = barsAround().reduce((sum, { offsetHeight }) => sum + offsetHeight, 0);
    const free = innerHeight - bars - LEAST_VIEWS_PX + (this.#isOpen ? this.#stage.offsetHeight : 0);
    const max = Math.max(LEAST_PX, Math.round(free));
    const min = Math.min(MIN_PX, max);
    const usual = Math.min(DEFAULT_SHARES[this.#kind] * innerHeight, max + LEAST_VIEWS_PX - VIEWS_PX);
    const chosen = Number(localStorage.getItem(STORED_HEIGHT + this.#kind)) || usual;
    const height = Math.round(Math.max(min, Math.min(max, chosen)));
    this.#stage.style.height = `${height}px`;
    showPosition(this.#grip, { now: height, min, max });
    const drawerPx = this.#panel.offsetHeight;
    if (drawerPx !== this.#store.facts.drawerPx) this.#store.set({ drawerPx });
  }

  /** @param {number | null} height null for the default */
  #resize(height) {
    localStorage.setItem(STORED_HEIGHT + this.#kind, height === null ? "" : String(Math.max(MIN_PX, Math.round(height))));
    this.#fit();
  }
}

/** The bars around the views; the drawer is part of the last one. */
function barsAround() {
  return /** @type {HTMLElement[]} */ ([...document.querySelectorAll(".top-bar, #advice, #joint-bar, footer")]);
}

/**
 * Whether a tab has nothing to show.
 *
 * @param {import("../model/store.js").Facts} facts
 * @param {Tab} tab
 */
function isEmpty(facts, tab) {
  if (tab === "search") return !hasSearch(facts.state) && facts.searchRuns?.runs.length === 0;
  if (tab === "runs") return facts.rangeComparison === null;
  if (tab === "doubts") return listDoubts(facts).length === 0;
  return facts.timeline.size === 0;
}
