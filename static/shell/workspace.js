/**
 * Widths of the camera panes and of the 3-D view beside them. The panes are as wide as their images can use, unless the user
 * has moved the separator. The 3-D view folds away on request, or where the inspector leaves the panes too little room. The
 * place of the separator and the choice are stored.
 */

import { usefulWidth } from "../layout/grid_layout.js";
import { byId } from "../widgets/elements.js";
import { inArea } from "../widgets/key_matching.js";
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

export class Workspace {
  #element = byId("workspace", HTMLElement);
  #bar = byId("split", HTMLElement);
  #inspector = byId("inspector", HTMLElement);
  #button = byId("show-scene", HTMLButtonElement);
  #store;
  /** Share chosen by the user; null for the automatic one. */
  #chosen = Number(localStorage.getItem(STORED)) || null;
  /** The automatic width by what it depends on, of which only the newest is needed. */
  #useful = { from: "", width: 0 };
  /** @type {Fold} */
  #fold = restoredFold();

  /** @param {import("../model/store.js").Store} store */
  constructor(store) {
    this.#store = store;
    makeSeparator(this.#bar, {
      position: () => this.#show(),
      moveTo: (position) => this.#moveTo(position),
      reset: () => this.#reset(),
    });
    this.#bar.addEventListener("keydown", (event) => {
      if (event.key !== "Enter") return;
      event.preventDefault();
      this.toggleScene();
    });
    this.#button.addEventListener("click", () => this.toggleScene());
    let isLookingThrough = false;
    store.on(["session"], () => this.#show());
    store.on(["state"], () => {
      const looks = (store.facts.state?.snapped ?? null) !== null;
      if (looks && !isLookingThrough && this.#isFolded) this.toggleScene();
      isLookingThrough = looks;
    });
    const sizes = new ResizeObserver(() => this.#show());
    sizes.observe(this.#element);
    sizes.observe(this.#inspector);
  }

  get bindings() {
    const words = "show hide close collapse scene panel";
    return inArea("3-D view", [{ label: "3-D view: fold away or open (toggle)", words, run: () => this.toggleScene() }]);
  }

  /** Fold the 3-D view away, or open it. */
  toggleScene() {
    this.#choose(!this.#isFolded);
  }

  /** Width beside the inspector. */
  get #width() {
    return this.#element.clientWidth - this.#inspector.offsetWidth;
  }

  get #isFolded() {
    return this.#fold === null ? this.#isCramped : this.#fold === "folded";
  }

  get #isCramped() {
    if (this.#inspector.hidden) return false;
    const width = this.#width - MIN_SCENE_PX;
    return width < MIN_PANES_PX || (width < CRAMPED_WIDTH_PX && this.#element.clientHeight < CRAMPED_HEIGHT_PX);
  }

  /** @param {boolean} isFolded */
  #choose(isFolded) {
    this.#fold = isFolded === this.#isCramped ? null : isFolded ? "folded" : "open";
    if (this.#fold) localStorage.setItem(STORED_FOLD, this.#fold);
    else localStorage.removeItem(STORED_FOLD);
    this.#show();
  }

  /** Apply the widths. Returns the width of the panes. */
  #show() {
    const isFolded = this.#isFolded;
    const whole = this.#element.clientWidth;
    const bar = this.#bar.offsetWidth;
    const max = this.#width - MIN_SCENE_PX;
    const min = Math.min(MIN_PANES_PX, max);
    const panes = isFolded ? this.#width - bar : Math.round(Math.max(min, Math.min(max, this.#chosen ? this.#chosen * whole : this.#automatic(whole))));
    this.#element.classList.toggle("is-scene-folded", isFolded);
    this.#element.style.setProperty("--panes-width", `${panes}px`);
    const share = 100 / Math.max(1, whole);
    showPosition(this.#bar, { now: share * panes, min: share * min, max: share * (this.#width - bar) });
    this.#button.setAttribute("aria-pressed", String(!isFolded));
    this.#button.title = `3-D view: ${isFolded ? "open it" : "fold it away"}`;
    return panes;
  }

  /** @param {number} whole width of the workspace */
  #automatic(whole) {
    const { session, drawerPx } = this.#store.facts;
    const aspects = session?.cameras.map(({ width, height }) => width / height) ?? [];
    // The height without a drawer: opening one moves no separator.
    const height = this.#element.clientHeight + drawerPx;
    const from = JSON.stringify([aspects, whole, height]);
    if (from !== this.#useful.from) {
      const widths = { usual: USUAL_FRACTION * whole, max: MAX_FRACTION * whole };
      this.#useful = { from, width: usefulWidth(aspects, widths, height) };
    }
    return this.#useful.width;
  }

  /** @param {number} position */
  #moveTo(position) {
    const edge = this.#width - this.#bar.offsetWidth;
    if (this.#isFolded && position > edge - OPEN_PX) return;
    const folds = position > edge - MIN_SCENE_PX / 2;
    if (folds !== this.#isFolded) this.#choose(folds);
    if (folds) return;
    this.#chosen = position / this.#element.clientWidth;
    this.#chosen = this.#show() / this.#element.clientWidth;
    localStorage.setItem(STORED, String(this.#chosen));
  }

  #reset() {
    this.#chosen = null;
    localStorage.removeItem(STORED);
    this.#choose(this.#isCramped);
  }
}

/** @returns {Fold} */
function restoredFold() {
  const stored = localStorage.getItem(STORED_FOLD);
  return stored === "folded" || stored === "open" ? stored : null;
}
