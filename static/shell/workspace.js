/**
 * Widths of the camera panes and of the 3-D view beside them. The panes are as wide as their images can use, unless the user
 * has moved the separator. The 3-D view folds away on request, or where the inspector leaves the panes too little room. The
 * place of the separator and the choice are stored.
 */

import { usefulWidth } from "../layout/grid_layout.js";
import { byId } from "../widgets/elements.js";
import { command, inArea } from "../widgets/key_matching.js";
import { makeSeparator, showPosition } from "../widgets/separator.js";

const STORED = "quadrille.panes-fraction";
const STORED_FOLD = "quadrille.scene-fold";
/** Automatic share of the panes: the usual one, and the largest, which leaves a 3-D view in which a person can be seen. */
const [USUAL_FRACTION, MAX_FRACTION] = [0.62, 0.75];
const MIN_PANES_PX = 480;
const MIN_SCENE_PX = 300;
/** Panes below both sizes, beside inspector and 3-D view, are too small for work. */
const [CRAMPED_WIDTH_PX, CRAMPED_HEIGHT_PX] = [900, 340];
/** The 3-D view is opened from its folded state by moving the separator this far. */
const OPEN_PX = 20;

/** @typedef {"folded" | "open" | null} Fold choice of the user; null where it is the automatic one */

/** @typedef {ReturnType<typeof mountWorkspace>} Workspace */

/** @param {import("../model/store.js").Store} store */
export function mountWorkspace(store) {
  const workspace = byId("workspace", HTMLElement);
  const split = byId("split", HTMLElement);
  const inspector = byId("inspector", HTMLElement);
  const opener = byId("show-scene", HTMLButtonElement);
  /** Share chosen by the user; null for the automatic one. */
  let chosen = Number(localStorage.getItem(STORED)) || null;
  /** The automatic width by what it depends on, of which only the newest is needed. */
  let useful = { from: "", width: 0 };
  /** @type {Fold} */
  let fold = restoredFold();

  makeSeparator(split, { position: show, moveTo, reset });
  split.addEventListener("keydown", (event) => {
    if (event.key !== "Enter") return;
    event.preventDefault();
    toggleScene();
  });
  opener.addEventListener("click", toggleScene);
  let isLookingThrough = false;
  store.on(["session"], show);
  store.on(["state"], () => {
    const looks = (store.facts.state?.snapped ?? null) !== null;
    if (looks && !isLookingThrough && isFolded()) toggleScene();
    isLookingThrough = looks;
  });
  const sizes = new ResizeObserver(() => show());
  sizes.observe(workspace);
  sizes.observe(inspector);

  /** Fold the 3-D view away, or open it. */
  function toggleScene() {
    choose(!isFolded());
  }

  /** Width beside the inspector. */
  function width() {
    return workspace.clientWidth - inspector.offsetWidth;
  }

  function isFolded() {
    return fold === null ? isCramped() : fold === "folded";
  }

  function isCramped() {
    if (inspector.hidden) return false;
    const beside = width() - MIN_SCENE_PX;
    return beside < MIN_PANES_PX || (beside < CRAMPED_WIDTH_PX && workspace.clientHeight < CRAMPED_HEIGHT_PX);
  }

  /** @param {boolean} folds */
  function choose(folds) {
    fold = folds === isCramped() ? null : folds ? "folded" : "open";
    if (fold) localStorage.setItem(STORED_FOLD, fold);
    else localStorage.removeItem(STORED_FOLD);
    show();
  }

  /** Apply the widths. Returns the width of the panes. */
  function show() {
    const isAway = isFolded();
    const whole = workspace.clientWidth;
    const free = width() - split.offsetWidth;
    const max = width() - MIN_SCENE_PX;
    const min = Math.min(MIN_PANES_PX, max);
    const panes = isAway ? free : Math.round(Math.max(min, Math.min(max, chosen ? chosen * whole : automatic(whole))));
    workspace.classList.toggle("is-scene-folded", isAway);
    workspace.style.setProperty("--panes-width", `${panes}px`);
    const share = 100 / Math.max(1, whole);
    showPosition(split, { now: share * panes, min: share * min, max: share * free });
    opener.setAttribute("aria-pressed", String(!isAway));
    opener.title = `3-D view: ${isAway ? "open it" : "fold it away"}`;
    return panes;
  }

  /** @param {number} whole width of the workspace */
  function automatic(whole) {
    const { session, drawerPx } = store.facts;
    const aspects = session?.cameras.map(({ width, height }) => width / height) ?? [];
    // The height without a drawer: opening one moves no separator.
    const height = workspace.clientHeight + drawerPx;
    const from = JSON.stringify([aspects, whole, height]);
    if (from !== useful.from) {
      const widths = { usual: USUAL_FRACTION * whole, max: MAX_FRACTION * whole };
      useful = { from, width: usefulWidth(aspects, widths, height) };
    }
    return useful.width;
  }

  /** @param {number} position */
  function moveTo(position) {
    const edge = width() - split.offsetWidth;
    if (isFolded() && position > edge - OPEN_PX) return;
    const folds = position > edge - MIN_SCENE_PX / 2;
    if (folds !== isFolded()) choose(folds);
    if (folds) return;
    chosen = position / workspace.clientWidth;
    chosen = show() / workspace.clientWidth;
    localStorage.setItem(STORED, String(chosen));
  }

  function reset() {
    chosen = null;
    localStorage.removeItem(STORED);
    choose(isCramped());
  }

  const words = "show hide close collapse scene panel";
  return { bindings: inArea("3-D view", [command("3-D view: fold away or open (toggle)", words, toggleScene)]) };
}

/** @returns {Fold} */
function restoredFold() {
  const stored = localStorage.getItem(STORED_FOLD);
  return stored === "folded" || stored === "open" ? stored : null;
}
