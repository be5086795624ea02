/**
 * Timeline: navigation through the recording, ranges of frames, tracking, and the drawer with its curves.
 *
 * The room imports `widgets`, `model`, `panes` and `posing`.
 */

import { byId } from "../widgets/elements.js";
import { mountCurveTools, mountCurves } from "./curves.js";
import { mountDoubtList } from "./doubt_list.js";
import { makeDoubtQueue } from "./doubt_queue.js";
import { mountDrawer } from "./drawer.js";
import { makeFrameWindow } from "./frame_window.js";
import { mountJumpMenu } from "./jump_menu.js";
import { makeJumps } from "./jumps.js";
import { makePlayback } from "./playback.js";
import { mountRangeBar } from "./range_bar.js";
import { mountTimeline } from "./timeline.js";
import { curveBindings, drawerBindings, frameBindings, queueBindings, timelineBindings, trackBindings } from "./timeline_keys.js";
import { mountTrackBar } from "./track_bar.js";
import { mountTransport } from "./transport.js";

/** @typedef {ReturnType<typeof mount>} TimelineRoom */

/**
 * Build the bars below the views, the drawer and the timeline.
 *
 * @param {import("../model/index.js").Context} context
 * @param {import("../panes/index.js").Panes} panes
 * @param {import("../posing/index.js").PosingRoom} posing
 */
export function mount({ store, actions, navigation, reasons, say }, { grid }, { curveEdits }) {
  const playback = makePlayback(store, navigation);
  const queue = makeDoubtQueue(store, navigation, actions, grid);
  const jumps = makeJumps(store, navigation, (frame) => queue.arriveAt(frame));
  const frameWindow = makeFrameWindow(store);
  mountTransport(store, navigation, playback, actions);
  mountTrackBar(store, actions);
  const drawer = mountDrawer(store);
  mountRangeBar(store, actions, () => drawer.open("runs"));
  mountJumpMenu(store, jumps, () => drawer.open("doubts"));
  mountDoubtList(store, queue);
  mountCurves(store, navigation, actions, frameWindow, curveEdits);
  mountCurveTools(store, curveEdits, say);
  mountTimeline(byId("timeline", HTMLElement), { store, navigation, jumps, frameWindow });
  const bindings = [
    ...frameBindings(navigation, playback),
    ...trackBindings(store, actions, reasons),
    ...timelineBindings({ store, actions, playback, jumps, frameWindow, reasons }),
    ...drawerBindings(drawer),
    ...curveBindings(curveEdits),
    ...queueBindings(queue, reasons.away),
  ];
  return { bindings, drawer, jumps, queue };
}
