/** The keys: one table that is both obeyed and shown to whoever asks with `?`. */

import { hasSearch, hasTrack } from "../model/selectors.js";
import { BY_KEY } from "../model/layers.js";
import { closePopover } from "../widgets/popovers.js";
import { posingBindings } from "../posing/posing_keys.js";
import { alt, control, plain } from "../widgets/key_matching.js";
import { peopleBindings } from "./people_keys.js";
import { timelineBindings } from "../timeline/timeline_keys.js";
import { sceneBindings } from "../scene/scene_keys.js";
import { unavailableReasons } from "../model/unavailable_reasons.js";
import { keepsUndo } from "../widgets/typing.js";

/** Keys that belong to viser's camera while the 3-D view has the focus. */
const VISER_KEYS = new Set(["s", "w", "a", "d", "q", "e", "arrowleft", "arrowright", "arrowup", "arrowdown"]);

/** Keys that move a slider which has the focus. */
const SLIDER_KEYS = new Set([
  "ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown", "Home", "End", "PageUp", "PageDown",
]); // prettier-ignore

/**
 * @typedef {object} Parts
 * @property {import("../model/store.js").Store} store
 * @property {import("../model/actions.js").Actions} actions
 * @property {import("../model/navigation.js").Navigation} navigation
 * @property {import("../timeline/playback.js").Playback} playback
 * @property {import("../timeline/jumps.js").Jumps} jumps
 * @property {import("../timeline/frame_window.js").FrameWindow} frameWindow
 * @property {import("../panes/pane_grid.js").PaneGrid} grid
 * @property {import("../panes/gestures.js").Gestures} gestures
 * @property {import("../timeline/drawer.js").Drawer} drawer
 * @property {import("../posing/posing.js").Posing} posing
 * @property {import("../posing/inspector.js").Inspector} inspector
 * @property {import("../model/layers.js").Layers} layers
 * @property {import("../panes/layers_menu.js").LayersMenu} layersMenu
 * @property {import("./people.js").People} people
 * @property {import("../scene/camera_view.js").CameraView} cameraView
 * @property {import("../posing/pinning.js").Pinning} pinning
 * @property {import("../scene/floor.js").Floor} floor
 * @property {import("./notices.js").Notices} notices
 * @property {import("./history_list.js").HistoryList} history
 * @property {() => void} showPalette
 * @property {() => void} showFirstSteps
 * @property {() => void} showKeyList
 */

/**
 * @param {Parts} parts
 * @returns {import("../widgets/key_matching.js").Binding[]}
 */
// prettier-ignore
export function bindings({
  store, actions, navigation, playback, jumps, frameWindow, grid, gestures, drawer, posing, pinning, inspector, layers,
  layersMenu, people, cameraView, floor, notices, history, showPalette, showFirstSteps, showKeyList,
}) {
  const escape = () => {
    if (gestures.cancel() || closePopover() || floor.cancel() || pinning.cancel() || actions.leaveReplay()) return;
    if (hasTrack(store.facts.state)) actions.stopTracking();
    else if (store.facts.state?.range.running) actions.stopRange();
    else if (hasSearch(store.facts.state)) actions.search("stop");
    else if (notices.dismiss()) return;
    else if (store.facts.range) store.set({ range: null });
    else if (store.facts.filled !== null) grid.toggleFill(store.facts.filled);
  };
  const why = unavailableReasons(store);
  const search = (/** @type {"step" | "stage" | "frame"} */ action) => () => {
    if (store.facts.connected && !store.facts.state?.job.running) actions.search(action);
  };
  const track = (/** @type {"forward" | "backward"} */ way) => () => {
    if (store.facts.connected && !store.facts.state?.track.running) actions.track(way);
  };
  const mark = (/** @type {"first" | "last"} */ end) => () => {
    const { range, target } = store.facts;
    const other = end === "first" ? (range?.last ?? target) : (range?.first ?? target);
    store.set({ range: { first: Math.min(target, other), last: Math.max(target, other) } });
  };
  return [
    ...area("Frames", [
    { keys: [","], label: "Previous frame", matches: plain(",", "Comma"), run: () => navigation.step(-1) },
    { keys: ["."], label: "Next frame", matches: plain(".", "Period"), run: () => navigation.step(1) },
    { keys: ["Shift ,"], label: "Ten frames back", matches: plain("<", "Comma", true), run: () => navigation.step(-10) },
    { keys: ["Shift ."], label: "Ten frames on", matches: plain(">", "Period", true), run: () => navigation.step(10) },
    { keys: ["Home"], label: "First frame", matches: plain("home"), run: () => navigation.first() },
    { keys: ["End"], label: "Last frame", matches: plain("end"), run: () => navigation.last() },
    { keys: ["Space"], label: "Play or pause", matches: plain(" "), run: () => playback.toggle() },
    ]),
    ...area("History and help", [
    { keys: ["Ctrl K"], label: "Commands", matches: control("k", false), anywhere: true, run: showPalette },
    { keys: ["Ctrl Z"], label: "Undo", matches: control("z", false), anywhere: true, why: why.undo, run: () => actions.undo() },
    {
      keys: ["Ctrl Shift Z", "Ctrl Y"],
      label: "Redo",
      anywhere: true,
      why: why.redo,
      matches: (event) => control("z", true)(event) || control("y", false)(event),
      run: () => actions.redo(),
    },
    { keys: ["H"], label: "History: what was done, and back to it", matches: plain("h"), run: () => history.toggle() },
    { keys: ["Shift H"], label: "Notices so far", matches: plain("h", undefined, true), run: () => notices.toggleLog() },
    { keys: ["Shift Esc"], label: "Dismiss the notices", matches: plain("escape", undefined, true), run: () => notices.dismissAll() },
    { keys: ["?"], label: "Keys", matches: (event) => event.key === "?", run: showKeyList },
    { keys: [], label: "First steps: what to do with a new recording", matches: () => false, run: showFirstSteps },
    ]),
    ...area("Search", [
    { keys: ["S"], label: "Search: one step", matches: plain("s"), why: why.search, run: search("step") },
    { keys: ["Shift S"], label: "Search: to the end of the stage", matches: plain("s", undefined, true), why: why.search, run: search("stage") },
    { keys: ["Shift F"], label: "Search: again from the same start", matches: plain("f", undefined, true), run: () => actions.searchAgain() },
    { keys: ["F"], label: "Search: this frame", matches: plain("f"), why: why.search, run: search("frame") },
    ]),
    ...area("Tracking", [
    {
      keys: ["Esc"],
      label: "Cancel the drag, leave the replay, else stop what is at work, else put the marked range away",
      matches: plain("escape"),
      run: escape,
    },
    { keys: ["T"], label: "Track forward", matches: plain("t"), why: why.track, run: track("forward") },
    { keys: ["Shift T"], label: "Track backward", matches: plain("t", undefined, true), why: why.track, run: track("backward") },
    { keys: ["Alt P"], label: "Pause tracking, or go on", matches: alt("KeyP", false), why: why.tracking, run: () => actions.togglePause() },
    { keys: ["L"], label: "Follow the tracker, or not", matches: plain("l"), why: why.tracking, run: () => actions.toggleFollow() },
    ]),
    ...area("Timeline", [
    ...timelineBindings({ store, actions, playback, jumps, frameWindow }),
    { keys: ["["], label: "A range begins here", matches: plain("[", "BracketLeft"), run: mark("first") },
    { keys: ["]"], label: "The range ends here", matches: plain("]", "BracketRight"), run: mark("last") },
    ]),
    // Before the keys of posing: Enter means the floor while it is being set.
    ...area("3-D view", [
    ...sceneBindings(cameraView, floor, plain),
    ], why.away),
    ...area("Posing", [
    ...posingBindings(posing, inspector, plain),
    ], why.away),
    ...area("People", peopleBindings({ store, actions, posing, people }), why.away),
    ...area("Pins", [
    { keys: ["X"], label: "Pin the selected joint by clicks, or no more", matches: plain("x"), run: () => pinning.toggle() },
    { keys: ["G"], label: "Fit to pins and edges", matches: plain("g"), run: () => pinning.fit() },
    {
      keys: ["Shift G"],
      label: "The body follows pins that are dragged, or not",
      matches: plain("g", undefined, true),
      run: () => pinning.toggleLive(),
    },
    {
      keys: ["Delete"],
      label: "Remove the pin under the pointer, else those of the joint",
      matches: plain("delete"),
      run: () => pinning.remove(),
    },
    {
      keys: ["Shift Delete"],
      label: "Remove all pins of the person on this frame",
      matches: plain("delete", undefined, true),
      run: () => pinning.clear(),
    },
    ], why.away),
    ...area("Views", [
    { keys: ["C"], label: "Curves", matches: plain("c"), run: () => drawer.toggleCurves() },
    { keys: ["B"], label: "Search: watch it in the drawer", matches: plain("b"), run: () => drawer.toggle("search") },
    { keys: ["V"], label: "Landscape of the cost", matches: plain("v"), run: () => drawer.toggle("landscape") },
    { keys: ["A"], label: "Layers", matches: plain("a"), run: () => layersMenu.toggle() },
    {
      keys: ["Shift 1 – 9"],
      label: "Show or hide a layer, by its number in the menu",
      matches: (event) => plain("", event.code, true)(event) && /^Digit[1-9]$/.test(event.code),
      run: (event) => layers.toggle([BY_KEY[Number(event.code.at(-1)) - 1]]),
    },
    { keys: ["I"], label: "Brightness and contrast of a pane", matches: plain("i"), run: () => grid.openToneMenu() },
    {
      keys: ["1 – 9"],
      label: "Fill the grid with a camera, and back; two digits for 10 to 16",
      matches: (event) => plain(event.key.toLowerCase())(event) && /^[1-9]$/.test(event.key),
      run: (event) => grid.typeCamera(Number(event.key)),
    },
    { keys: ["PageDown"], label: "Fill the grid with the next camera", matches: plain("pagedown"), run: () => grid.stepFill(1) },
    { keys: ["PageUp"], label: "Fill the grid with the camera before", matches: plain("pageup"), run: () => grid.stepFill(-1) },
    {
      keys: ["0"],
      label: "Show the whole image",
      matches: plain("0"),
      run: () => grid.typeCamera(0) || grid.resetViews(),
    },
    ]),
  ];
}

/**
 * Say what some bindings are about, and why none of them is possible where that is so.
 *
 * @param {string} name
 * @param {import("../widgets/key_matching.js").Binding[]} table
 * @param {() => string | null} [why]
 * @returns {import("../widgets/key_matching.js").Binding[]}
 */
function area(name, table, why) {
  return table.map((binding) => ({ area: name, why, ...binding }));
}

/**
 * Obey the keys pressed in a document.
 *
 * @param {Document} target the page's, or that of the 3-D view
 * @param {import("../widgets/key_matching.js").Binding[]} table
 * @param {{viser: boolean, isDragging: () => boolean, say: (why: string) => void}} options `say` tells the user why a key
 *   does nothing now
 */
export function listen(target, table, { viser, isDragging, say }) {
  target.addEventListener("keydown", (event) => {
    const from = /** @type {HTMLElement | null} */ (event.target);
    const isEscape = event.key === "Escape";
    if (event.defaultPrevented || document.querySelector("dialog[open]")) return;
    if (!isEscape && (isDragging() || operates(from, event))) return;
    if (viser && !event.ctrlKey && VISER_KEYS.has(event.key.toLowerCase())) return;
    const binding = table.find(({ matches }) => matches(event));
    if (!binding || (writes(from) && !isEscape && !(binding.anywhere && !keepsUndo(from, event)))) return;
    event.preventDefault();
    const why = binding.why?.();
    if (why) say(why);
    binding.run(event);
  });
}

/** @param {HTMLElement | null} element */
function writes(element) {
  // A field of a dialog that has just been closed has the focus until the page is drawn again.
  if (element?.closest?.("dialog:not([open])")) return false;
  return !!element?.matches?.("input:not([type=radio], [type=checkbox], [type=range]), textarea, select, [contenteditable=true]");
}

/**
 * Whether the key means something to the control that has the focus.
 *
 * @param {HTMLElement | null} element
 * @param {KeyboardEvent} event
 */
function operates(element, event) {
  if (element?.matches?.("input[type=range]") && SLIDER_KEYS.has(event.key)) return true;
  if (event.key.startsWith("Arrow")) {
    return !!element?.matches?.("[type=radio], [role=slider], [role=separator], [role=menuitem], [role=tab]");
  }
  return [" ", "Enter"].includes(event.key) && !!element?.matches?.("button, input, a, summary, [role=button]");
}
