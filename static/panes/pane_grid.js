/** Grid of the panes of all cameras, or one pane that fills it. */

import { arrange, fit, layOut, movedShares } from "../layout/grid_layout.js";
import { keep, kept, keptByName } from "../layout/kept_views.js";
import { PeopleFollower, boxOf, followView, keepLink, keptLink, seen } from "./linked_views.js";
import { makePane } from "./pane.js";
import { makePaneBorders } from "../layout/pane_borders.js";
import { isInSight } from "../model/selectors.js";
import { cornersOf, outlineOf } from "./part_hit.js";
import { PaneShares } from "../layout/pane_shares.js";

/** Smallest size of what is framed, in that of the body: a limb is judged by what it hangs on. */
const MIN_SHARE = 0.4;
/** Two digits within this time form one number. */
const SECOND_DIGIT_MS = 700;
/** Facts that change the marks over the overlay. @type {(keyof import("../model/store.js").Facts)[]} */
const MARKED = ["hover", "hoverPart", "pinHover", "heldPin", "observability", "provenance", "finding", "epipolar", "epipolarLines", "showsMisfits", "calibration"];
/** Facts after which views follow the people: overlay and state of a frame arrive in any order. @type {(keyof import("../model/store.js").Facts)[]} */
const FOLLOWED = ["overlay", "state", "dragging"];
/** Facts that change the pictures. @type {(keyof import("../model/store.js").Facts)[]} */
const PICTURED = ["shown", "placeholder", "layers", "imageTones", "bare"];

/**
 * @typedef {import("./pane.js").Pane} Pane
 * @typedef {{watch: (pane: Pane, camera: number) => void}} PointerTarget handles the pointer in a pane
 */

export class PaneGrid {
  /** @type {Pane[]} */
  panes = [];
  #store;
  /** @type {PointerTarget[]} the last one added comes first */
  #pointerTargets = [];
  #latency;
  #openToneMenu;
  #element;
  #borders;
  #shares = new PaneShares();
  #arrangement = { isColumns: false, counts: [1] };
  #digit = { value: 0, at: -Infinity };
  #built = "";
  #choice = "";
  #follower = new PeopleFollower();
  /** Whether the views are to be framed at the next overlay: the session opens, and no view was moved yet. */
  #isOpening = false;
  /** Whether whole images are the views that nobody has chosen yet. */
  #isFirst = false;
  /** @type {number | null} frame on which people were found last */
  #foundOn = null;
  /** Panes whose view changes with that of another, or of all. @type {Set<number>} */
  #following = new Set();
  /** Cameras of the views that were zoomed to joints last. @type {Set<number>} */
  #zoomedToJoints = new Set();

  /**
   * @param {HTMLElement} element
   * @param {import("../model/store.js").Store} store
   * @param {import("../widgets/latency.js").Latency} latency
   * @param {(camera: number, button: HTMLElement) => void} openToneMenu opens the tone popover of a camera
   */
  constructor(element, store, latency, openToneMenu) {
    this.#openToneMenu = openToneMenu;
    this.#element = element;
    this.#store = store;
    this.#latency = latency;
    this.#borders = makePaneBorders(element, (border, size) => {
      this.#shares.choose(this.#arrangement, border.of, size === null ? null : movedShares(border, size));
      this.#layOut();
    });
    store.subscribe((changed) => this.#update(changed));
    store.set({ linkedViews: keptLink() });
    new ResizeObserver(() => this.#layOut()).observe(element);
    // Moving the window to another screen changes the device pixel ratio, but not the size of the element.
    addEventListener("resize", () => this.#layOut());
  }

  /**
   * Let a target handle the pointer in all panes, before targets that were added earlier.
   *
   * @param {PointerTarget} target
   */
  addPointerTarget(target) {
    this.#pointerTargets.unshift(target);
  }

  /**
   * Let one pane fill the grid, or show all panes again.
   *
   * @param {number} camera
   */
  toggleFill(camera) {
    if (camera >= this.panes.length) return;
    this.#store.set({ filled: this.#store.facts.filled === camera ? null : camera, active: camera });
  }

  /**
   * Fill the grid with the camera of a number, counted from 1. With more than nine cameras, two digits in quick succession
   * form one number.
   *
   * @param {number} digit
   * @returns  whether the digit was used
   */
  typeCamera(digit) {
    const now = performance.now();
    const { value, at } = this.#digit;
    const both = now - at < SECOND_DIGIT_MS ? 10 * value + digit : digit;
    const number = both <= this.panes.length ? both : digit;
    this.#digit = { value: digit, at: now };
    if (number < 1 || number > this.panes.length) return false;
    if (number > 9) this.#store.set({ filled: number - 1, active: number - 1 });
    else this.toggleFill(number - 1);
    return true;
  }

  /**
   * Fill the grid with the next or the previous camera.
   *
   * @param {1 | -1} step
   */
  stepFill(step) {
    const { filled } = this.#store.facts;
    const count = this.panes.length;
    const next = filled === null ? (step > 0 ? 0 : count - 1) : (filled + step + count) % count;
    if (count > 0) this.#store.set({ filled: next, active: next });
  }

  /** Open the tone popover of the pane under the pointer, or else of the active pane. */
  openToneMenu() {
    const under = this.panes.findIndex((pane) => pane.element.matches(":hover"));
    const camera = under >= 0 ? under : (this.#store.facts.filled ?? this.#store.facts.active ?? 0);
    if (camera < this.panes.length) this.#openToneMenu(camera, this.panes[camera].toneButton);
  }

  /** Reset the view of the pane under the pointer, or else of all panes. */
  resetViews() {
    const under = this.panes.filter((pane) => pane.element.matches(":hover"));
    if (under.length === 0) this.#following = new Set(this.panes.keys());
    for (const pane of under.length ? under : this.panes) pane.reset();
  }

  /** Link the zoom of all views, or no longer; the others follow the view that the pointer was in last. */
  toggleLink() {
    const { linkedViews, active } = this.#store.facts;
    this.#store.set({ linkedViews: !linkedViews });
    keepLink(!linkedViews);
    if (this.panes.length) this.#follow(active ?? 0);
  }

  /**
   * Let the other views follow one, if views are linked.
   *
   * @param {number} camera
   */
  #follow(camera) {
    const { linkedViews, overlay } = this.#store.facts;
    if (!linkedViews) return;
    this.#following = new Set(this.panes.keys());
    this.#following.delete(camera);
    followView(this.panes, camera, overlay?.handles ?? []);
    // A view that stays as it is reports no change: its next own change would count as following.
    requestAnimationFrame(() => requestAnimationFrame(() => this.#following.clear()));
  }

  /** Zoom every view to the people in it; with Solo, to the selected person. */
  framePeople() {
    this.#following = new Set(this.panes.keys());
    this.panes.forEach((pane, camera) => pane.frame(this.#boxIn(camera)));
  }

  /**
   * Box around the people in a view; with Solo, around the selected person. Null if none is in it.
   *
   * @param {number} camera
   */
  #boxIn(camera) {
    const { overlay, state, session } = this.#store.facts;
    const meant = (overlay?.handles ?? []).filter(({ person }) => !state?.solo || person === state.person);
    return boxOf(seen(meant, camera, session?.cameras[camera] ?? { width: 0, height: 0 }));
  }

  /** Let zoomed views follow the people from frame to frame, or no longer. */
  togglePeopleFollowed() {
    this.#follower.toggle();
    return this.#follower.isOn;
  }

  /**
   * Zoom the views that show some joints of a person to them; those in which they are occluded only if no view shows them.
   * The other views stay, but those that an earlier call had zoomed show the whole person again.
   *
   * @param {number} person
   * @param {string[]} points
   */
  frameJoints(person, points) {
    const { overlay, session, state } = this.#store.facts;
    const handles = (overlay?.handles ?? []).filter((one) => one.person === person);
    const inside = session?.cameras.flatMap((info, camera) => seen(handles, camera, info)) ?? [];
    const meant = inside.filter(({ point }) => points.includes(point));
    const inSight = meant.filter((one) => isInSight(state, one));
    const cameras = new Set((inSight.length ? inSight : meant).map(({ camera }) => camera));
    const moved = [...new Set([...cameras, ...this.#zoomedToJoints])];
    this.#following = new Set(moved);
    for (const camera of moved) {
      const [ofBody, own] = [inside, meant].map((joints) => joints.filter((one) => one.camera === camera));
      this.panes[camera].frame(boxOf(cameras.has(camera) ? withMargin(own, extentOf(ofBody)) : ofBody));
    }
    this.#zoomedToJoints = cameras;
  }

  /**
   * Zoom a view to a part of a person; a view that another covers comes in its place.
   *
   * @param {{camera: number, person: number, part: number}} meant
   */
  framePart({ camera, person, part }) {
    const { overlay, filled } = this.#store.facts;
    const outline = overlay && outlineOf(overlay, { camera, person, part });
    if (!overlay || !outline) return;
    if (filled !== null && filled !== camera) this.#store.set({ filled: camera });
    const body = overlay.handles.filter((one) => one.camera === camera && one.person === person);
    this.#following = new Set([camera]);
    this.panes[camera].frame(boxOf(withMargin(cornersOf(overlay.segments, outline), extentOf(body))));
    this.#store.set({ active: camera });
    this.#zoomedToJoints.add(camera);
  }

  /** Whether panes have other sizes than the automatic ones. */
  get isResized() {
    return this.#shares.isChosen;
  }

  /** Return to the automatic sizes of all panes. */
  resetSizes() {
    this.#shares.reset();
    this.#layOut();
  }

  /**
   * Window position of an undistorted pixel.
   *
   * @param {number} camera
   * @param {number} u
   * @param {number} v
   */
  toClient(camera, u, v) {
    const pane = this.panes[camera];
    const box = pane.surface.getBoundingClientRect();
    const { x, y } = pane.view.toScreen(u, v);
    return { x: box.left + x, y: box.top + y };
  }

  /** @param {Set<keyof import("../model/store.js").Facts>} changed */
  #update(changed) {
    if (changed.has("session")) this.#build();
    if (changed.has("filled")) this.#fill();
    if (changed.has("bare")) document.body.classList.toggle("is-bare", this.#store.facts.bare);
    if (changed.has("finding")) this.#expectPeople();
    // Not under the hand: a view that is late waits for the end of the drag.
    const isFollowed = FOLLOWED.some((fact) => changed.has(fact)) && !this.#store.facts.dragging;
    const isMoved = isFollowed && this.#follower.take(this.panes, this.#store.facts);
    if (changed.has("overlay")) this.#frameAtOpening();
    if (changed.has("target")) this.#ask(this.panes.map((pane) => pane.reduction()));
    if (changed.has("active") || changed.has("session")) this.#markActive();
    const withPictures = isMoved || PICTURED.some((fact) => changed.has(fact));
    // Each move of a drag changes the state, but only these fields of it change the vectors.
    const { person, point, solo } = this.#store.facts.state ?? {};
    const choice = JSON.stringify([person, point, solo]);
    const marked = MARKED.some((fact) => changed.has(fact));
    if (withPictures || changed.has("overlay") || choice !== this.#choice || marked) {
      this.#choice = choice;
      for (const pane of this.panes) pane.draw(withPictures);
    }
    if (changed.has("overlay")) this.#latency.painted(this.#store.facts.overlay?.seq ?? 0);
    if (changed.has("target") || changed.has("shown")) {
      this.#element.classList.toggle("is-loading", this.#store.facts.shown?.frame !== this.#store.facts.target);
    }
    if (changed.has("state")) for (const pane of this.panes) pane.showCost();
  }

  #markActive() {
    const active = this.#store.facts.active ?? 0;
    this.panes.forEach((pane, camera) => pane.element.classList.toggle("is-active", camera === active));
  }

  #build() {
    const { name = "", cameras = [] } = this.#store.facts.session ?? {};
    // The session is sent again on each connection. With the same cameras, zoom and filled pane remain.
    const described = JSON.stringify([name, cameras]);
    if (described === this.#built) return;
    this.#built = described;
    this.#zoomedToJoints.clear();
    this.#shares.open(name);
    const views = keptByName("views", name);
    this.#isOpening = true;
    this.#isFirst = views === null;
    this.#follower.forget();
    this.panes = cameras.map((info, camera) => {
      const pane = makePane(this.#store, camera, info, { viewChanged: () => this.#viewChanged(camera), openToneMenu: this.#openToneMenu });
      pane.view.restore(views?.[info.name]);
      for (const target of this.#pointerTargets) target.watch(pane, camera);
      pane.element.addEventListener("dblclick", (event) => {
        if (!(event.target instanceof Element && event.target.closest("button"))) this.toggleFill(camera);
      });
      return pane;
    });
    this.#element.replaceChildren(...this.panes.map((pane) => pane.element));
    const filled = cameras.findIndex((info) => info.name === kept("filled-pane", name));
    this.#store.set(filled < 0 ? { filled: null } : { filled, active: filled });
    this.#layOut();
  }

  /** @param {number} camera */
  #viewChanged(camera) {
    this.#isOpening = false;
    this.#follower.moved(camera);
    this.#refine();
    this.#keep();
    if (!this.#following.delete(camera)) this.#follow(camera);
  }

  /**
   * Show the people when the session opens, if anybody has a pose: views that were never moved or were framed are framed,
   * and so are views of a place where nobody is now.
   */
  #frameAtOpening() {
    const { overlay, state } = this.#store.facts;
    if (!this.#isOpening || !overlay || !state) return;
    this.#isOpening = false;
    if (!state.people.some(({ source }) => source !== null)) return;
    if (this.panes.every(({ view }) => view.isReset) && this.#isFirst) return this.framePeople();
    this.panes.forEach((pane, camera) => {
      const box = this.#boxIn(camera);
      if (box && !pane.view.isReset && (pane.view.isFramed || !pane.view.shows(box))) {
        this.#following.add(camera);
        pane.frame(box);
      }
    });
  }

  /** Frame people who have just been found, if no view was moved. */
  #expectPeople() {
    const { finding } = this.#store.facts;
    const isNew = !!finding?.running && finding.frame !== null && finding.frame !== this.#foundOn;
    this.#foundOn = finding?.frame ?? null;
    if (isNew && this.panes.every(({ view }) => view.isReset)) this.#isOpening = this.#isFirst = true;
  }

  /** Keep the zoom of all views. */
  #keep() {
    const { session } = this.#store.facts;
    if (!session) return;
    const names = session.cameras.map(({ name }) => name);
    keep("views", session.name, Object.fromEntries(this.panes.map((pane, camera) => [names[camera], pane.view.choice])));
  }

  #fill() {
    const { session, filled } = this.#store.facts;
    if (session) keep("filled-pane", session.name, filled === null ? null : session.cameras[filled].name);
    this.#layOut();
  }

  #layOut() {
    const cameras = this.#store.facts.session?.cameras ?? [];
    if (cameras.length === 0) return;
    const { filled } = this.#store.facts;
    const { clientWidth, clientHeight } = this.#element;
    const shown = filled === null ? cameras : [cameras[filled]];
    const aspects = shown.map(({ width, height }) => width / height);
    // The drawer takes height and leaves the arrangement: panes stay where the user knows them.
    const { arrangement } = arrange(aspects, clientWidth, clientHeight + this.#store.facts.drawerPx);
    const { shares: automatic } = fit(arrangement, aspects, clientWidth, clientHeight);
    this.#arrangement = arrangement;
    const shares = this.#shares.of(arrangement, automatic);
    const { boxes, borders } = layOut(arrangement, shares, clientWidth, clientHeight);
    this.panes.forEach((pane, camera) => {
      if (filled === null) pane.place(boxes[camera]);
      else pane.place(filled === camera ? boxes[0] : null);
    });
    let first = 0;
    const names = arrangement.counts.map((count) => shown.slice(first, (first += count)).map(({ name }) => name));
    this.#borders.show(borders, arrangement.isColumns, names);
    this.#ask(this.panes.map((pane) => pane.reduction()));
  }

  /** Request finer pictures after zooming in. Coarser pictures can wait for the next frame. */
  #refine() {
    const { reductions } = this.#store.facts;
    this.#ask(this.panes.map((pane, camera) => Math.min(pane.reduction(), reductions[camera] ?? pane.reduction())));
  }

  /** @param {number[]} reductions */
  #ask(reductions) {
    if (reductions.join() !== this.#store.facts.reductions.join()) this.#store.set({ reductions });
  }
}

/** @typedef {{u: number, v: number}} Place */

/**
 * The longer side of the box around places, px.
 *
 * @param {Place[]} places
 */
function extentOf(places) {
  const span = (/** @type {number[]} */ values) => Math.max(...values) - Math.min(...values);
  return Math.max(span(places.map(({ u }) => u)), span(places.map(({ v }) => v)));
}

/**
 * Places whose box surrounds others, and is at least a share of the body wide and high.
 *
 * @param {Place[]} places
 * @param {number} body size of the body, px
 * @returns {Place[]}
 */
function withMargin(places, body) {
  const mean = (/** @type {number[]} */ values) => (Math.max(...values) + Math.min(...values)) / 2;
  const middle = { u: mean(places.map(({ u }) => u)), v: mean(places.map(({ v }) => v)) };
  const half = (MIN_SHARE * body) / 2;
  return [...places, { u: middle.u - half, v: middle.v - half }, { u: middle.u + half, v: middle.v + half }];
}
