/**
 * What the page knows, in one place. Views read it; they are told once per animation frame what changed, however many
 * messages came in between.
 */

import { Cells } from "./cells.js";
import { defaultLayers } from "./layers.js";

/**
 * @typedef {{camera: number, person: number, point: string}} Joint
 * @typedef {{frame: number, pictures: import("./pictures.js").Pictures}} Shown
 *
 * @typedef {Map<string, {bitmap: OffscreenCanvas, limitPx: null}>} PlaceholderPictures as `Pictures`, which may have all layers
 * @typedef {{frame: number, target: number, pictures: PlaceholderPictures | null}} Placeholder pictures: those of `frame`,
 *   without vectors; null where `frame` is the one shown anyway
 *
 * @typedef {object} Facts
 * @property {boolean} connected
 * @property {import("./protocol.js").SessionMessage | null} session
 * @property {import("./protocol.js").StateMessage | null} state
 * @property {import("./cells.js").Cells} timeline the known cells by frame
 * @property {import("./cells.js").Cells[]} lanes the same of each person, where there are several
 * @property {number[]} disagreeing frames whose pose does not go together with those around it, ascending
 * @property {import("../widgets/frame_axis.js").Span | null} visible the part of the recording that timeline and curves show; null: all
 * @property {import("./series.js").Curves | null} curves the group of curves that came last
 * @property {import("./series.js").Tab | null} drawer what the drawer shows; null while it is closed
 * @property {import("./protocol.js").SearchSetupMessage | null} searchSetup
 * @property {import("./protocol.js").SearchRunsMessage | null} searchRuns
 * @property {Map<number, import("./search_runs.js").Steps>} searchSteps recorded steps by run
 * @property {Map<number, import("./search_runs.js").Candidates>} searchCandidates best poses by run
 * @property {number | null} searchRun the run that the user looks at; null for the newest
 * @property {boolean} replaying whether a search is being replayed step by step
 * @property {import("./search_runs.js").Landscape | null} landscape
 * @property {import("./protocol.js").HistoryMessage | null} history what the list of the history shows
 * @property {{first: number, last: number} | null} range the frames that the user has marked
 * @property {Shown | null} shown the pictures on the screen
 * @property {Placeholder | null} placeholder what is shown until the pictures of the frame asked for are there
 * @property {import("./protocol.js").Overlay | null} overlay the vectors on the screen
 * @property {Joint | null} hover the joint under the pointer
 * @property {{camera: number, person: number, part: number} | null} hoverPart the part under the pointer, where no joint is
 * @property {boolean} dragging whether a hand holds a joint
 * @property {number | null} active the camera whose pane was last pointed at; steps of keys are parallel to its image
 * @property {number | null} dof the degree of freedom that keys turn, of those that the selected joint means
 * @property {boolean} pinning whether each click sets a pin of the selected joint
 * @property {boolean} livePins whether the body follows while a pin is dragged
 * @property {Joint | null} pinHover the pin under the pointer
 * @property {import("./protocol.js").PinMark | null} heldPin the pin in the hand, or just let go
 * @property {"all" | "one"} scope whom searches and fits move: everybody, or the person worked on alone
 * @property {number} target the frame the user asked for last
 * @property {boolean} playing
 * @property {number} rate at which a clip plays, 1 for real time
 * @property {boolean} loops whether playing begins anew at the end, of the marked range where there is one
 * @property {boolean} everyFrame whether playing waits for every frame instead of skipping those that come late
 * @property {number | null} filled the camera whose pane fills the grid
 * @property {import("./layers.js").LayerChoice} layers what is drawn in the panes
 * @property {(import("./image_tone.js").ImageTone | undefined)[]} imageTones brightness, contrast and gamma of each camera's image
 * @property {number[]} reductions how many pixels of each camera's image the page can do with one for; 0: it is not seen
 */

const MAX_ROUNDS = 3;

export class Store {
  /** @type {Facts} */
  facts = {
    connected: false,
    session: null,
    state: null,
    timeline: new Cells(0),
    lanes: [],
    disagreeing: [],
    visible: null,
    curves: null,
    drawer: null,
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
    livePins: true,
    pinHover: null,
    heldPin: null,
    scope: "all",
    target: 0,
    playing: false,
    rate: 1,
    loops: false,
    everyFrame: false,
    filled: null,
    layers: defaultLayers(),
    imageTones: [],
    reductions: [],
  };
  /** @type {((changed: Set<keyof Facts>) => void)[]} */
  #views = [];
  /** @type {Set<keyof Facts>} */
  #changed = new Set();
  #isScheduled = false;

  /**
   * Change facts; views hear of it on the next animation frame.
   *
   * @param {Partial<Facts>} facts
   */
  set(facts) {
    if (!this.#isScheduled) {
      this.#isScheduled = true;
      requestAnimationFrame(() => this.#flush());
    }
    Object.assign(this.facts, facts);
    for (const key of Object.keys(facts)) this.#changed.add(/** @type {keyof Facts} */ (key));
  }

  /** @param {(changed: Set<keyof Facts>) => void} view */
  subscribe(view) {
    this.#views.push(view);
  }

  /**
   * @param {keyof Facts} fact
   * @param {() => void} act done once, when the fact is there
   */
  onceKnown(fact, act) {
    let isDone = false;
    this.subscribe(() => {
      if (isDone || this.facts[fact] === null) return;
      isDone = true;
      act();
    });
  }

  #flush() {
    // What views change meanwhile is shown at once too, not an animation frame later.
    for (let round = 0; round < MAX_ROUNDS && this.#changed.size > 0; round += 1) {
      const changed = this.#changed;
      this.#changed = new Set();
      for (const view of this.#views) view(changed);
    }
    this.#isScheduled = false;
    if (this.#changed.size > 0) this.set({});
  }

  /**
   * Whether the vectors on the screen belong to the images under them and to the program's frame: only then does a hand
   * that grabs a joint mean what it sees. While a tracker is followed the program is always a little ahead.
   */
  get isSettled() {
    const { state, shown, placeholder, overlay, connected } = this.facts;
    if (placeholder) return false;
    const isThere = shown?.frame === state?.frame || (state?.track.running && state.follow);
    return connected && !!state && !!isThere && overlay?.frame === shown?.frame;
  }
}
