/** Puts the page together: messages go into the store, the views read it, gestures and keys send. */

import { Actions } from "./model/actions.js";
import { Announcer } from "./shell/announcer.js";
import { Connection } from "./model/connection.js";
import { Curves } from "./timeline/curves.js";
import { Drawer } from "./timeline/drawer.js";
import { button, byId } from "./widgets/elements.js";
import { Floor } from "./scene/floor.js";
import { FirstSteps } from "./shell/first_steps.js";
import { FrameCard } from "./posing/frame_card.js";
import { FrameWindow } from "./timeline/frame_window.js";
import { Gestures } from "./panes/gestures.js";
import { HistoryList } from "./shell/history_list.js";
import { Inspector } from "./posing/inspector.js";
import { JumpMenu } from "./timeline/jump_menu.js";
import { Jumps } from "./timeline/jumps.js";
import { KeyList } from "./shell/key_list.js";
import * as keys from "./shell/keys.js";
import { CostLandscape } from "./search/cost_landscape.js";
import { Latency } from "./model/latency.js";
import { Layers } from "./model/layers.js";
import { LayersMenu } from "./panes/layers_menu.js";
import { ImageToneMenu } from "./panes/image_tone_menu.js";
import { showProgressMarks } from "./shell/progress_marks.js";
import { ImageTones } from "./model/image_tone.js";
import { Navigation } from "./model/navigation.js";
import { Notices, watchConnection } from "./shell/notices.js";
import { Palette } from "./shell/palette.js";
import { People } from "./shell/people.js";
import { PaneGrid } from "./panes/pane_grid.js";
import { PinBar } from "./posing/pin_bar.js";
import { Pinning } from "./posing/pinning.js";
import { Posing } from "./posing/posing.js";
import { Playback } from "./timeline/playback.js";
import { RangeBar } from "./timeline/range_bar.js";
import { unavailableReasons } from "./model/unavailable_reasons.js";
import { RecentImages } from "./model/recent_images.js";
import { Receiver } from "./model/receiver.js";
import { SavedMark } from "./shell/saved_mark.js";
import { ScenePause } from "./scene/pause.js";
import { followColorScheme } from "./scene/color_scheme.js";
import { SearchPanel } from "./search/search_panel.js";
import { CameraView } from "./scene/camera_view.js";
import { makeSplitter } from "./widgets/splitter.js";
import { PlaceholderFrames } from "./panes/placeholder_frames.js";
import { Store } from "./model/store.js";
import { Timeline } from "./timeline/timeline.js";
import { TopBar } from "./shell/top_bar.js";
import { TrackBar } from "./timeline/track_bar.js";
import { Transport } from "./timeline/transport.js";
import { watchTyping } from "./widgets/typing.js";
import { ViewRequest } from "./model/view_request.js";
import { drawsInSoftware } from "./widgets/webgl.js";

// A token has become a cookie by now, and does not belong into the history or a screenshot.
if (location.search) window.history.replaceState(null, "", location.pathname);

const store = new Store();
const latency = new Latency();
const notices = new Notices();
const notify = notices.show.bind(notices);
const recentImages = new RecentImages();
const receiver = new Receiver(store, notify, recentImages);
/** @type {(message: import("./model/protocol.js").ClientMessage) => void} */
const send = (message) => connection.send(message);

const actions = new Actions(store, send);
const gestures = new Gestures(store, send, latency);
const navigation = new Navigation(store, send);
const layers = new Layers(store);
const layersMenu = new LayersMenu(store, layers);
const toneMenu = new ImageToneMenu(store, new ImageTones(store));
const openToneMenu = toneMenu.toggle.bind(toneMenu);
const pinning = new Pinning(store, send, notify);
// Who watches first has the pointer first: a pin's head may lie over a joint.
const pointers = {
  watch: (/** @type {import("./panes/pane.js").Pane} */ pane, /** @type {number} */ camera) => {
    pinning.watch(pane, camera);
    gestures.watch(pane, camera);
  },
};
const grid = new PaneGrid(byId("panes", HTMLElement), store, pointers, latency, openToneMenu);
new PlaceholderFrames(store, recentImages);
new ViewRequest(store, send);
const posing = new Posing(store, send);
const inspector = new Inspector(byId("inspector", HTMLElement), store, posing, notify);
const floor = new Floor(byId("panes", HTMLElement), store, grid, send);
const cameraView = new CameraView(store, grid, send);
new TopBar(store, actions);
const people = new People(store, actions, posing);
showProgressMarks(store);
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
new CostLandscape(store, send);
new Curves(store, navigation, actions, frameWindow);
new Timeline(byId("timeline", HTMLElement), { store, navigation, jumps, frameWindow });
watchConnection(byId("banner", HTMLElement), store);
makeSplitter(byId("workspace", HTMLElement), byId("split", HTMLElement));

const history = new HistoryList(store, send);
new SavedMark(store, send);
new Announcer(byId("announcer", HTMLElement), store);
const firstSteps = new FirstSteps(store);
const context = { store, navigation, grid, posing, layers, actions, away: unavailableReasons(store).away };
const palette = new Palette(context, () => table);
button("show-palette", () => palette.toggle());
const showPalette = palette.toggle.bind(palette);
const showFirstSteps = firstSteps.show.bind(firstSteps);
const showKeyList = () => keyList.show();
const table = keys.bindings({
  store, actions, navigation, playback, jumps, frameWindow, grid, gestures, drawer, posing, pinning, inspector, layers,
  layersMenu, people, cameraView, floor, notices, history, showPalette, showFirstSteps, showKeyList,
}); // prettier-ignore
const keyList = new KeyList(table);
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
if (inSoftware) new ScenePause(scene, store);
// The panes come first: viser's program is large, and would hold their first pictures up.
store.onceKnown("shown", () => followColorScheme(scene));

const connection = new Connection(receiver, inSoftware ? { type: "pause_3d", pause: true } : null);

Object.assign(window, {
  quadrille: {
    latencies: latency.latencies,
    toClient: grid.toClient.bind(grid),
    get state() {
      const { frame, pictures = new Map() } = store.facts.shown ?? {};
      const placeholder = store.facts.placeholder && { ...store.facts.placeholder, pictures: store.facts.placeholder.pictures !== null };
      const sizes = [...pictures].map(([key, { bitmap }]) => [key, [bitmap.width, bitmap.height]]);
      const shown = { frame, pictures: Object.fromEntries(sizes) };
      const views = grid.panes.map(({ view }) => ({ zoom: view.zoom, scale: view.scale, origin: view.origin }));
      return { ...store.facts, timeline: Object.fromEntries(store.facts.timeline), shown, placeholder, views };
    },
  },
});
