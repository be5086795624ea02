/**
 * Store of all facts that the page knows. Views read it, and are notified once per animation frame of what has changed.
 */

import { Cells } from "./cells.js";
import { defaultLayers } from "./layers.js";

/**
 * @typedef {{camera: number, person: number, point: string}} Joint
 * @typedef {Joint & {overlapping?: {person: number, point: string}[]}} HoveredJoint overlapping: the joints at the same
 *   place, itself included
 * @typedef {{camera: number, u: number, v: number}} ViewPoint undistorted px
 * @typedef {{frame: number, pictures: import("./pictures.js").Pictures}} Shown
 *
 * @typedef {Map<string, {bitmap: OffscreenCanvas, limitPx: null}>} PlaceholderPictures like `Pictures`, of images only
 * @typedef {{frame: number, target: number, pictures: PlaceholderPictures | null}} Placeholder pictures: those of `frame`,
 *   without overlay; null if `frame` is the frame shown
 *
 * @typedef {object} OtherFacts
 * @property {boolean} connected
 * @property {string | null} opening name of another session that the program is opening
 * @property {string} openingStep what the program is doing to open it; empty while unknown
 * @property {import("./cells.js").Cells} timeline cells of all people together
 * @property {import("./cells.js").Cells[]} lanes cells of each person, if there are several
 * @property {number[]} disagreeing frames whose pose is inconsistent with its neighbours, ascending
 * @property {import("./protocol.js").KeyframeDoubt[]} keyframeDoubts keyframes that their neighbours or views contradict
 * @property {import("./protocol.js").RangeComparisonMessage | null} rangeComparison poses of a range and those that they replaced
 * @property {import("../widgets/frame_axis.js").Span | null} visible the visible part of timeline and curves; null for all
 * @property {import("./series.js").Curves | null} curves the current group of curves
 * @property {import("./series.js").Tab | null} drawer the open tab; null while the drawer is closed
 * @property {number} drawerPx height that the open drawer takes from the views, CSS pixels
 * @property {{choice: import("./theme.js").ThemeChoice, isDark: boolean}} theme
 * @property {import("./protocol.js").ObservationsMessage | null} observations imported observations and their judgement
 * @property {import("./provenance.js").Filter | null} provenanceFilter poses that the timeline does not dim; null for all
 * @property {import("./protocol.js").OtherCopyMessage | null} otherCopy the copy of the session that is compared; null without one
 * @property {boolean} showsMisfits whether the views show where the contours of the last check miss the edges
 * @property {number | null} exporting share of an export that is done, 0 to 1; null without one
 * @property {Map<number, import("./search_runs.js").Steps>} searchSteps recorded steps by run
 * @property {Map<number, import("./search_runs.js").Candidates>} searchCandidates best poses by run
 * @property {number | null} searchRun the selected run; null for the newest
 * @property {boolean} replaying whether a replay is playing
 * @property {import("./search_runs.js").Landscape | null} landscape
 * @property {{first: number, last: number} | null} range the marked frames, both included
 * @property {Shown | null} shown the pictures that are displayed
 * @property {Placeholder | null} placeholder what is shown until the requested frame arrives
 * @property {import("./protocol.js").Overlay | null} overlay the overlay that is displayed
 * @property {HoveredJoint | null} hover the joint under the pointer
 * @property {{camera: number, person: number, part: number} | null} hoverPart the part under the pointer, if no joint is
 * @property {boolean} dragging whether a joint or pin is being dragged
 * @property {number | null} active the camera whose pane the pointer was in last; arrow keys move parallel to its image
 * @property {number | null} dof the degree of freedom that keys change, one of the selected joint
 * @property {boolean} pinning whether each click pins the selected joint
 * @property {{kept: ViewPoint[], pointer: ViewPoint | null} | null} epipolar places of the epipolar check; null without one
 * @property {import("./protocol.js").EpipolarMessage | null} epipolarLines of the first of them
 * @property {boolean} livePins whether the body follows a dragged pin
 * @property {{person: number, point: string, state: import("./protocol.js").StateMessage | null} | null} pressed the joint that was pressed last, with the
 *   state at that time: until there is another state, it is the selected joint
 * @property {Joint | null} pinHover the pin under the pointer
 * @property {import("./protocol.js").PinMark | null} heldPin the pin that is dragged or was just released
 * @property {"all" | "one"} scope people that searches and fits move: all, or the active person only
 * @property {number} target the frame that was requested last
 * @property {boolean} playing
 * @property {number} rate playback speed, 1 for real time
 * @property {boolean} loops whether playback loops, within the marked range if there is one
 * @property {boolean} everyFrame whether playback waits for every frame instead of skipping late ones
 * @property {boolean} linkedViews whether all views follow the zoom of one
 * @property {number | null} filled the camera whose pane fills the grid
 * @property {import("./layers.js").LayerChoice} layers visible layers and their opacity
 * @property {boolean} bare whether the views show pictures alone, without anything drawn over them
 * @property {(import("./image_tone.js").ImageTone | undefined)[]} imageTones tone of each camera's image
 * @property {number[]} reductions pixels of each camera's image per displayed pixel, per side; 0 if not visible
 */

/**
 * @template {string} Name
 * @typedef {Name extends `${infer First}_${infer Rest}` ? `${First}${Capitalize<CamelCase<Rest>>}` : Name} CamelCase
 */
/** @typedef {import("./protocol.js").TextMessage} Message */
/** @typedef {{[M in Message as CamelCase<M["type"]>]: M | null}} MessageFacts the last message of each type */
/** @typedef {OtherFacts & Omit<MessageFacts, keyof OtherFacts | "notice" | "imported" | "inconsistent">} Facts */

const MAX_ROUNDS = 3;
/** Facts beside the pictures that a playing page shows with the next pictures, or after that time: each time that something
 * changes, the browser composes the page again, which takes as long as the pictures do without a graphics card.
 * @type {Set<string>} */
const SHOWN_WITH_PICTURES = new Set(["state", "presence"]);
const READABLE_MS = 200;

export class Store {
  /** @type {Facts} */
  facts = {
    connected: false,
    opening: null,
    openingStep: "",
    session: null,
    state: null,
    timeline: new Cells(0),
    lanes: [],
    observability: null,
    costMap: null,
    reason: null,
    rangeComparison: null,
    disagreeing: [],
    keyframeDoubts: [],
    visible: null,
    curves: null,
    drawer: null,
    drawerPx: 0,
    theme: { choice: "system", isDark: true },
    settings: null,
    view3d: null,
    bodySizes: null,
    advice: null,
    acquisition: null,
    finding: null,
    calibration: null,
    clocks: null,
    observations: null,
    annotation: null,
    presence: null,
    provenance: null,
    annotators: null,
    provenanceFilter: null,
    otherCopy: null,
    showsMisfits: false,
    exporting: null,
    searchSetup: null,
    searchRuns: null,
    searchSteps: new Map(),
    searchCandidates: new Map(),
    searchRun: null,
    replaying: false,
    landscape: null,
    history: null,
    range: null,
    shown: null,
    placeholder: null,
    overlay: null,
    hover: null,
    hoverPart: null,
    dragging: false,
    active: null,
    dof: null,
    pinning: false,
    epipolar: null,
    epipolarLines: null,
    livePins: true,
    pressed: null,
    pinHover: null,
    heldPin: null,
    scope: "all",
    target: 0,
    playing: false,
    rate: 1,
    loops: false,
    everyFrame: false,
    linkedViews: false,
    filled: null,
    layers: defaultLayers(),
    bare: false,
    imageTones: [],
    reductions: [],
  };
  /** @type {((changed: Set<keyof Facts>) => void)[]} */
  #views = [];
  /** @type {Set<keyof Facts>} */
  #changed = new Set();
  #isScheduled = false;
  /** Timer after which facts that wait for pictures are shown without; 0 for none. */
  #timer = 0;

  /**
   * Change facts. Views are notified on the next animation frame; while the page plays, some facts wait for the next pictures.
   *
   * @param {Partial<Facts>} facts
   */
  set(facts) {
    Object.assign(this.facts, facts);
    const keys = /** @type {(keyof Facts)[]} */ (Object.keys(facts));
    for (const key of keys) this.#changed.add(key);
    if (this.#isScheduled) return;
    if (!this.facts.playing || !keys.length || keys.some((key) => !SHOWN_WITH_PICTURES.has(key))) this.#schedule();
    else this.#timer ||= setTimeout(() => this.#schedule(), READABLE_MS);
  }

  #schedule() {
    clearTimeout(this.#timer);
    this.#timer = 0;
    if (this.#isScheduled) return;
    this.#isScheduled = true;
    requestAnimationFrame(() => this.#flush());
  }

  /** @param {(changed: Set<keyof Facts>) => void} view */
  subscribe(view) {
    this.#views.push(view);
  }

  /**
   * @param {(keyof Facts)[]} facts
   * @param {() => void} act called whenever one of them has changed
   */
  on(facts, act) {
    this.subscribe((changed) => facts.some((fact) => changed.has(fact)) && act());
  }

  /**
   * @param {import("./series.js").Tab} tab
   * @param {(keyof Facts)[]} facts
   * @param {() => void} act called when the tab of the drawer opens, and whenever one of the facts has changed while it is open
   */
  onTab(tab, facts, act) {
    this.on(["drawer", ...facts], () => this.facts.drawer === tab && act());
  }

  #flush() {
    // Changes made by views are shown in the same animation frame.
    for (let round = 0; round < MAX_ROUNDS && this.#changed.size > 0; round += 1) {
      const changed = this.#changed;
      this.#changed = new Set();
      for (const view of this.#views) view(changed);
    }
    this.#isScheduled = false;
    if (this.#changed.size > 0) this.set({});
  }

  /**
   * Whether overlay, images and the program's frame agree, so that joints can be dragged. While a tracker is followed, the
   * program is always slightly ahead.
   */
  get isSettled() {
    const { state, shown, placeholder, overlay, connected } = this.facts;
    if (placeholder) return false;
    const isThere = shown?.frame === state?.frame || (state?.track.running && state.follow);
    return connected && !!state && !!isThere && overlay?.frame === shown?.frame;
  }
}
