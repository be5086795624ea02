/**
 * Sessions: open another one, or make one of videos and a calibration.
 *
 * The room imports `widgets` and types of `model`.
 */

import { inArea } from "../widgets/key_matching.js";
import { Sessions } from "./sessions.js";

/** @typedef {ReturnType<typeof mount>} SessionsRoom */

/**
 * Build the popover and the form.
 *
 * @param {import("../model/index.js").Context} context
 */
export function mount({ store, notify }) {
  const sessions = new Sessions(store, notify);
  const showNew = () => void sessions.showNew();
  const bindings = inArea("History and help", [
    {
      keys: ["Ctrl O"],
      label: "Open another session",
      words: "recent sessions folder recording file load switch",
      anywhere: true,
      run: () => sessions.toggle(),
    },
    { keys: [], label: "New session from videos and a calibration", words: "new session… create recording footage form cameras", run: showNew },
  ]);
  return { bindings, showNew, completes: (/** @type {HTMLInputElement} */ input) => sessions.completes(input) };
}
