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

/** @typedef {ReturnType<typeof mountDrawer>} Drawer */

/** @param {import("../model/store.js").Store} store */
export function mountDrawer(store) {
  let session = "";
  /** @type {Tab | null} tab to open once it is known to have content */
  let pending = null;
  /** Whether the open tab has had content, or must have some to stay open. */
  let needsContent = false;
  const panel = byId("drawer", HTMLElement);
  const stage = byId("drawer-stage", HTMLElement);
  const grip = byId("drawer-grip", HTMLElement);
  const parts = /** @type {HTMLElement[]} */ ([...panel.querySelectorAll("[data-tab]")]);
  const tabs = /** @type {HTMLInputElement[]} */ ([...document.querySelectorAll("input[name=drawer]")]);
  const toggleButton = button("show-curves", () => openTab(getIsOpen() ? null : getLastTab()));
  button("close-drawer", () => openTab(null));
  for (const tab of tabs) {
    onChange(tab, () => openTab(/** @type {import("../model/series.js").Tab} */ (tab.value)));
  }
  const getIsOpen = () => store.facts.drawer !== null;
  makeSeparator(grip, {
    position: () => -stage.clientHeight,
    moveTo: (position) => resize(-position),
    reset: () => resize(null),
  });
  addEventListener("resize", () => fit());
  const heights = new ResizeObserver(() => fit());
  for (const bar of [...barsAround(), byId("timeline", HTMLElement)]) heights.observe(bar);
  show(null);
  store.on(["session"], () => begin());
  store.on(["timeline"], () => pending && !isEmpty(store.facts, pending) && restore(pending));
  store.on(["timeline", "lanes", "searchRuns", "rangeComparison", "state"], () => check());

  /** Close the drawer in another session; open it there if it was open and has content. */
  function begin() {
    const name = store.facts.session?.name ?? "";
    if (name === session) return;
    session = name;
    const tab = kept("drawer", name);
    show(null);
    pending = tabs.some(({ value }) => value === tab) ? /** @type {Tab} */ (tab) : null;
  }

  /** @param {Tab} tab */
  function restore(tab) {
    show(tab);
    needsContent = tab !== "doubts";
  }

  /** Close the drawer if its content is gone. A receipt of resolved doubts stays. */
  function check() {
    const { facts } = store;
    const { drawer, connected } = facts;
    if (drawer === null || drawer === "doubts" || !connected || facts.session?.name !== session) return;
    if (drawer === "search" && !facts.searchRuns) return; // not known before the drawer has been open for a while
    if (!isEmpty(facts, drawer)) needsContent = true;
    else if (needsContent) openTab(null);
  }

  /**
   * Open a tab, or close the drawer if that tab is open.
   *
   * @param {Tab} tab
   */
  function toggle(tab) {
    openTab(store.facts.drawer === tab ? null : tab);
  }

  /** Open the last group of curves, or close the drawer if curves are shown. */
  function toggleCurves() {
    const stored = localStorage.getItem(STORED_CURVES);
    openTab(isCurves(store.facts.drawer) ? null : (CURVE_GROUPS.find((group) => group === stored) ?? "arms"));
  }

  function getLastTab() {
    const stored = localStorage.getItem(STORED_TAB);
    return /** @type {import("../model/series.js").Tab} */ (tabs.find(({ value }) => value === stored)?.value ?? "arms");
  }

  /** @param {Tab | null} tab */
  function openTab(tab) {
    keep("drawer", session, tab);
    show(tab);
    check();
  }

  /** @param {Tab | null} tab */
  function show(tab) {
    pending = null;
    needsContent = false;
    if (tab !== null) localStorage.setItem(STORED_TAB, tab);
    if (isCurves(tab)) localStorage.setItem(STORED_CURVES, String(tab));
    panel.hidden = tab === null;
    for (const part of parts) part.hidden = part.dataset.tab !== (isCurves(tab) ? "curves" : tab);
    toggleButton.setAttribute("aria-pressed", String(tab !== null));
    for (const one of tabs) one.checked = one.value === tab;
    store.set({ drawer: tab });
    fit();
  }

  /** Curves and thumbnails need less height than the search, so each kind has its own. */
  function getKind() {
    const { drawer } = store.facts;
    if (drawer === "doubts") return "doubts";
    return isCurves(drawer) ? "curves" : "search";
  }

  /** Apply the stored height, as far as the window has room for it. */
  function fit() {
    const bars = barsAround().reduce((sum, { offsetHeight }) => sum + offsetHeight, 0);
    const free = innerHeight - bars - LEAST_VIEWS_PX + (getIsOpen() ? stage.offsetHeight : 0);
    const max = Math.max(LEAST_PX, Math.round(free));
    const min = Math.min(MIN_PX, max);
    const usual = Math.min(DEFAULT_SHARES[getKind()] * innerHeight, max + LEAST_VIEWS_PX - VIEWS_PX);
    const chosen = Number(localStorage.getItem(STORED_HEIGHT + getKind())) || usual;
    const height = Math.round(Math.max(min, Math.min(max, chosen)));
    stage.style.height = `${height}px`;
    showPosition(grip, { now: height, min, max });
    const drawerPx = panel.offsetHeight;
    if (drawerPx !== store.facts.drawerPx) store.set({ drawerPx });
  }

  /** @param {number | null} height null for the default */
  function resize(height) {
    localStorage.setItem(STORED_HEIGHT + getKind(), height === null ? "" : String(Math.max(MIN_PX, Math.round(height))));
    fit();
  }

  return { toggle, open: openTab, toggleCurves };
}

/** The bars around the views; the drawer is part of the last one. */
/** @param {Tab | null} tab */
function isCurves(tab) {
  return CURVE_GROUPS.some((group) => group === tab);
}

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
