/**
 * Shell: what surrounds the views: top bar, the line of advice, people, history, command palette and keys.
 *
 * The room imports all other rooms.
 */

import { button, byId } from "../widgets/elements.js";
import { leaveFields, watchTyping } from "../widgets/typing.js";
import { mountAdvice } from "./advice.js";
import { mountAnnouncer } from "./announcer.js";
import { mountComparison } from "./comparison.js";
import { deeds } from "./deeds.js";
import { mountExportPanel } from "./export_panel.js";
import { mountHistoryList } from "./history_list.js";
import { makeKeyChoices, followChoices } from "./key_choices.js";
import { mountKeyList } from "./key_list.js";
import { listen, orderedByArea } from "./keys.js";
import { mountPalette } from "./palette.js";
import { mountPeople } from "./people.js";
import { mountSavedMark } from "./saved_mark.js";
import { escapeBindings, helpBindings, peopleBindings } from "./shell_keys.js";
import { mountTopBar } from "./top_bar.js";
import { mountWorkspace } from "./workspace.js";

/**
 * @typedef {object} Rooms
 * @property {import("../panes/index.js").Panes} panes
 * @property {import("../posing/index.js").PosingRoom} posing
 * @property {import("../timeline/index.js").TimelineRoom} timeline
 * @property {import("../search/index.js").SearchRoom} search
 * @property {import("../scene/index.js").SceneRoom} scene
 * @property {import("../inspector/index.js").InspectorRoom} inspector
 * @property {import("../annotation/index.js").AnnotationRoom} annotation
 * @property {import("../participants/index.js").ParticipantsRoom} participants
 * @property {import("../sessions/index.js").SessionsRoom} sessions
 */

/**
 * Build the bars, lists and dialogs around the views, and obey the keys of all rooms.
 *
 * @param {import("../model/index.js").Context} context
 * @param {Rooms} rooms
 * @returns {import("../widgets/key_matching.js").Binding[]} all keys and commands of the page
 */
export function mount(context, rooms) {
  const { store, send, actions, navigation, layers, reasons } = context;
  const { grid, gestures } = rooms.panes;
  const { posing, pinning } = rooms.posing;
  mountTopBar(store, actions);
  mountComparison(store, actions);
  const people = mountPeople(store, actions, posing);
  const workspace = mountWorkspace(store);
  const history = mountHistoryList(store, send);
  const advice = mountAdvice(store, deeds(context, rooms, mountExportPanel(store, context.say)));
  context.onNotice((notice) => advice.answer(notice));
  mountSavedMark(store, send);
  mountAnnouncer(byId("announcer", HTMLElement), store);
  button("show-palette", () => palette.toggle());

  const own = [
    ...helpBindings({ actions, history, advice, showPalette: () => palette.toggle(), showKeys: () => keyList.show(), reasons }),
    ...rooms.sessions.bindings,
    ...escapeBindings({ store, actions, advice, grid, gestures, pinning, epipolar: rooms.posing.epipolar, floor: rooms.scene.floor }),
    ...peopleBindings({ actions, posing, people, reasons }),
    ...workspace.bindings,
  ];
  const { panes, timeline, search, scene, inspector, annotation, participants } = rooms;
  const table = orderedByArea([
    own,
    ...[scene, search, timeline, rooms.posing, panes, inspector, annotation, participants].map(({ bindings }) => bindings),
  ]);
  const palette = mountPalette({ store, navigation, grid, posing, layers, actions, inspector: inspector.inspector, away: reasons.away }, table);
  const choices = makeKeyChoices(table, (text) => context.say(text, "error"));
  const keyList = mountKeyList(table, choices);
  followChoices(choices);
  store.on(["session"], () => store.facts.session?.role === "host" && void choices.load());
  obeyKeys(context, table, scene.frame);
  return table;
}

/**
 * Obey the keys that are pressed in the page or in the 3-D view.
 *
 * @param {import("../model/index.js").Context} context
 * @param {import("../widgets/key_matching.js").Binding[]} table
 * @param {HTMLIFrameElement} frame of the 3-D view
 */
function obeyKeys({ store, say }, table, frame) {
  const isDragging = () => store.facts.dragging;
  watchTyping(document);
  leaveFields(document);
  listen(document, table, { viser: false, isDragging, say });
  frame.addEventListener("load", () => {
    if (!frame.contentDocument) return;
    watchTyping(frame.contentDocument);
    listen(frame.contentDocument, table, { viser: true, isDragging, say });
  });
}
