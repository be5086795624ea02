/**
 * Sessions: open another one, make one of videos and a calibration, or calibrate its cameras by a board.
 *
 * The room imports `widgets` and types of `model`.
 */

import { inArea } from "../widgets/key_matching.js";
import { mountSessions } from "./sessions.js";

/** @typedef {ReturnType<typeof mount>} SessionsRoom */

/**
 * Build the popover and the form.
 *
 * @param {import("../model/index.js").Context} context
 */
export function mount({ store, say }) {
  const sessions = mountSessions(store, (text) => say(text, "error"));
  const showNew = () => void sessions.showNew();
  const bindings = inArea("History and help", [
    { label: "Open another session", words: "recent sessions folder recording file load switch", anywhere: true, run: () => sessions.toggle() },
    { label: "New session from videos and a calibration", words: "new session… create recording footage form cameras", run: showNew },
    { label: "Calibrate cameras by a board", words: "calibration… checkerboard charuco corners lenses", run: () => void sessions.showBoard() },
  ]);
  return { bindings, showNew, completes: sessions.completes };
}
