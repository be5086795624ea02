/** Puts the page together: messages go into the store, the views read it, gestures and keys send. */

import { Actions } from "./actions.js";
import { Announcer } from "./announcer.js";
import { Connection } from "./connection.js";
import { Curves } from "./curves.js";
import { Drawer } from "./drawer.js";
import { button, byId } from "./elements.js";
import { Floor } from "./floor.js";
import { FirstSteps } from "./first_steps.js";
import { FrameCard } from "./frame_card.js";
import { FrameWindow } from "./frame_window.js";
import { Gestures } from "./gestures.js";
import { HistoryList } from "./history_list.js";
import { Inspector } from "./inspector.js";
import { JumpMenu } from "./jump_menu.js";
import { Jumps } from "./jumps.js";
import { KeyMap } from "./key_map.js";
import * as keys from "./keys.js";
import { LandscapePanel } from "./landscape.js";
import { Latency } from "./latency.js";
import { Layers } from "./layers.js";
import { LayersMenu } from "./layers_menu.js";
import { LookMenu } from "./look_menu.js";
import { showProgress } from "./progress_marks.js";
import { Looks } from "./looks.js";
import { Navigation } from "./navigation.js";
import { Notices, watchConnection } from "./notices.js";
import { Palette } from "./palette.js";
import { People } from "./people.js";
import { PaneGrid } from "./pane_grid.js";
import { PinBar } from "./pin_bar.js";
import { Pinning } from "./pinning.js";
import { Posing } from "./posing.js";
import { Playback } from "./playback.js";
import { RangeBar } from "./range_bar.js";
import { reasonsOf } from "./reasons.js";
import { RecentImages } from "./recent_images.js";
import { Receiver } from "./receiver.js";
import { SavedMark } from "./saved_mark.js";
import { SceneRest } from "./scene_rest.js";
import { followScheme } from "./scene_scheme.js";
import { SearchPanel } from "./search_panel.js";
import { Snap } from "./snap.js";
import { makeSplitter } from "./splitter.js";
import { StandIns } from "./stand_ins.js";
import { Store } from "./store.js";
import { Timeline } from "./timeline.js";
import { TopBar } from "./top_bar.js";
import { TrackBar } from "./track_bar.js";
import { Transport } from "./transport.js";
import { watchTyping } from "./typing.js";
import { ViewRequest } from "./view_request.js";
import { drawsInSoftware } from "./webgl.js";

// A token has become a cookie by now, and does not belong into the history or a screenshot.
if (location.search) window.history.replaceState(null, "", location.pathname);

const store = new Store();
const latency = new Latency();
const notices = new Notices();
const notify = notices.show.bind(notices);
const recentImages = new RecentImages();
const receiver = new Receiver(store, notify, recentImages);
/** @type {(message: import("./protocol.js").ClientMessage) => void} */
const send = (message) => connection.send(message);

const actions = new Actions(store, send);
const gestures = new Gestures(store, send, latency);
const navigation = new Navigation(store, send);
const layers = new Layers(store);
const layersMenu = new LayersMenu(store, layers);
const lookMenu = new LookMenu(store, new Looks(store));
const openLook = lookMenu.toggle.bind(lookMenu);
const pinning = new Pinning(store, send, notify);
// Who watches first has the pointer first: a pin's head may lie over a joint.
const pointers = {
  watch: (/** @type {import("./pane.js").Pane} */ pane, /** @type {number} */ camera) => {
    pinning.watch(pane, camera);
    gestures.watch(pane, camera);
  },
};
const grid = new PaneGrid(byId("panes", HTMLElement), store, pointers, latency, openLook);
new StandIns(store, recentImages);
new ViewRequest(store, send);
const posing = new Posing(store, send);
const inspector = new Inspector(byId("inspector", HTMLElement), store, posing, notify);
const floor = new Floor(byId("panes", HTMLElement), store, grid, send);
const snap = new Snap(store, grid, send);
new TopBar(store, actions);
const people = new People(store, actions, posing);
showProgress(store);
const playback = new Playback(store, navigation);
const jumps = new Jumps(store, navigation);
const frameWindow = new FrameWindow(store);
new Transport(store, navigation, playback, actions);
new TrackBar(store, actions);
new JumpMenu(store, jumps);
new RangeBar(store, actions);
new FrameCard(store, posing);
new PinBar(store, pinning);
const drawer = new Drawer(store);
new SearchPanel(store, actions, send);
new LandscapePanel(store, send);
new Curves(store, navigation, actions, frameWindow);
new Timeline(byId("timeline", HTMLElement), { store, navigation, jumps, frameWindow });
watchConnection(byId("banner", HTMLElement), store);
makeSplitter(byId("workspace", HTMLElement), byId("split", HTMLElement));

const history = new HistoryList(store, send);
new SavedMark(store, send);
new Announcer(byId("announcer", HTMLElement), store);
const firstSteps = new FirstSteps(store);
const places = { store, navigation, grid, posing, layers, actions, away: reasonsOf(store).away };
const palette = new Palette(places, () => table);
button("show-palette", () => palette.toggle());
const showPalette = palette.toggle.bind(palette);
const showFirstSteps = firstSteps.show.bind(firstSteps);
const showHelp = () => keyMap.show();
const table = keys.bindings({
  store, actions, navigation, playback, jumps, frameWindow, grid, gestures, drawer, posing, pinning, inspector, layers,
  layersMenu, people, snap, floor, notices, history, showPalette, showFirstSteps, showHelp,
}); // prettier-ignore
const keyMap = new KeyMap(table);
watchTyping(document);

const isDragging = () => store.facts.dragging;
const say = (/** @type {string} */ text) => notify({ type: "notice", level: "info", text });
keys.listen(document, table, { viser: false, isDragging, say });
const scene = byId("scene", HTMLIFrameElement);
scene.addEventListener("load", () => {
  if (!scene.contentDocument) return;
  watchTyping(scene.contentDocument);
  keys.listen(scene.contentDocument, table, { viser: true, isDragging, say });
});
const inSoftware = drawsInSoftware();
if (inSoftware) new SceneRest(scene, store);
// The panes come first: viser's program is large, and would hold their first pictures up.
store.onceKnown("shown", () => followScheme(scene));

const connection = new Connection(receiver, inSoftware ? { type: "hold_3d", hold: true } : null);

Object.assign(window, {
  quadrille: {
    latencies: latency.latencies,
    toClient: grid.toClient.bind(grid),
    get state() {
      const { frame, pictures = new Map() } = store.facts.shown ?? {};
      const standIn = store.facts.standIn && { ...store.facts.standIn, pictures: store.facts.standIn.pictures !== null };
      const sizes = [...pictures].map(([key, { bitmap }]) => [key, [bitmap.width, bitmap.height]]);
      const shown = { frame, pictures: Object.fromEntries(sizes) };
      const views = grid.panes.map(({ view }) => ({ zoom: view.zoom, scale: view.scale, origin: view.origin }));
      return { ...store.facts, timeline: Object.fromEntries(store.facts.timeline), shown, standIn, views };
    },
  },
});
