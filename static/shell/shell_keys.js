/** Keys of history, help and messages, and Esc. */

import { hasSearch, hasTrack } from "../model/selectors.js";
import { inArea } from "../widgets/key_matching.js";
import { closePopover } from "../widgets/popovers.js";

/** @typedef {import("../widgets/key_matching.js").Binding} Binding */

/**
 * @param {{actions: import("../model/actions.js").Actions, history: import("./history_list.js").HistoryList,
 *   advice: import("./advice.js").AdviceLine, showPalette: () => void, showKeys: () => void,
 *   reasons: import("../model/unavailable_reasons.js").Reasons}} parts
 */
export function helpBindings({ actions, history, advice, showPalette, showKeys, reasons }) {
  return inArea("History and help", [
    { keys: ["Ctrl K"], label: "Commands", anywhere: true, run: showPalette },
    { keys: ["Ctrl Z"], label: "Undo the last change", anywhere: true, why: reasons.undo, run: () => actions.undo() },
    { keys: ["Ctrl Shift Z", "Ctrl Y"], label: "Redo the last change", anywhere: true, why: reasons.redo, run: () => actions.redo() },
    { label: "Show the pose before the last fit or search, or its result", why: reasons.compared, run: () => actions.toggleBefore() },
    { label: "History of edits", run: () => history.toggle() },
    { label: "Earlier sentences of the line", words: "messages log", run: () => advice.log.toggle() },
    { label: "Dismiss what the line says", words: "messages", run: () => void advice.dismiss() },
    { keys: ["?"], label: "Keyboard shortcuts", words: "keys change set", matches: (event) => event.key === "?", run: showKeys },
  ]);
}

/**
 * Esc ends the first of the activities below that is in progress.
 *
 * @param {{store: import("../model/store.js").Store, actions: import("../model/actions.js").Actions,
 *   advice: import("./advice.js").AdviceLine, grid: import("../panes/pane_grid.js").PaneGrid,
 *   gestures: import("../panes/gestures.js").Gestures, pinning: import("../posing/pinning.js").Pinning,
 *   epipolar: import("../posing/epipolar_check.js").EpipolarCheck, floor: import("../scene/floor.js").Floor}} parts
 * @returns {Binding[]}
 */
export function escapeBindings({ store, actions, advice, grid, gestures, pinning, epipolar, floor }) {
  const run = () => {
    if (gestures.cancel() || closePopover() || floor.cancel() || pinning.cancel() || epipolar.cancel()) return;
    if (store.facts.bare) return store.set({ bare: false });
    if (actions.leaveReplay() || actions.leaveBefore()) return;
    const { state, range, filled } = store.facts;
    if (hasTrack(state)) actions.stopTracking();
    else if (state?.range.running) actions.stopRange();
    else if (hasSearch(state)) actions.search("stop");
    else if (range) store.set({ range: null });
    else if (filled !== null) grid.toggleFill(filled);
    else advice.dismiss();
  };
  const label = "Cancel a drag, exit the replay, stop a run, or unmark the range";
  return inArea("Tracking", [{ keys: ["Esc"], label, matches: ({ key }) => key === "Escape", run }]);
}

/**
 * @param {{actions: import("../model/actions.js").Actions, posing: import("../posing/posing.js").Posing,
 *   people: import("./people.js").People, reasons: import("../model/unavailable_reasons.js").Reasons}} parts
 */
export function peopleBindings({ actions, posing, people, reasons }) {
  const why = reasons.people;
  return inArea("People", [
    { keys: ["P"], label: "Select the next person", why, run: () => actions.stepPerson(1) },
    { keys: ["Shift P"], label: "Select the previous person", why, run: () => actions.stepPerson(-1) },
    { label: "Solo: dim other people (toggle)", why, run: () => actions.toggleSolo() },
    { label: "Show or hide the active person", why, run: () => actions.toggleShown() },
    { label: "Search and fit everyone or only the active person (toggle)", why, run: () => actions.toggleScope() },
    { label: "Copy the next person's angles", why, run: () => posing.copyNextPerson() },
    { label: "List of people", why, run: () => people.toggle() },
  ]);
}
