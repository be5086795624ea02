/**
 * Reasons why commands are unavailable: sentences for the user, null if a command is available; and the messages that a page
 * with a shared link sends. The program refuses all others, too (app/messages/parsing.py).
 */

import { hasTrack } from "./selectors.js";

/** @typedef {() => string | null} Reason */

/** @typedef {ReturnType<typeof unavailableReasons>} Reasons */

/** @param {import("./store.js").Store} store */
export function unavailableReasons(store) {
  const facts = () => store.facts;
  const away = () =>
    facts().connected && facts().state ? null : "No connection to the program. The page reconnects automatically.";
  /** @type {(why: () => string | null) => Reason} */
  const here = (why) => () => away() ?? why();
  return {
    away,
    undo: here(() => (facts().state?.undo === null ? "Nothing to undo." : null)),
    redo: here(() => (facts().state?.redo === null ? "Nothing to redo." : null)),
    search: here(() => (facts().state?.job.running ? "A search is already running. Stop it first (Esc)." : null)),
    track: here(() => (facts().state?.track.running ? "Tracking is already running. Stop it first (Esc)." : null)),
    tracking: here(() => (hasTrack(facts().state) ? null : "Nothing is being tracked. Track forward or backward first.")),
    range: here(() => (facts().range ? null : "No range is marked. Drag over the timeline with Shift to mark one.")),
    compared: here(() => (facts().state?.compared ? null : "No fit or search result is shown. Fit or search first.")),
    people: here(() => ((facts().session?.people.length ?? 0) > 1 ? null : "This session has only one person.")),
  };
}

/** @typedef {import("./protocol.js").ClientMessage} ClientMessage */

/** @type {ClientMessage["type"][]} */
const LOOK = ["view", "epipolar", "curves", "history"];
/** Messages that move in a place of one's own. @type {ClientMessage["type"][]} */
const MOVES = ["seek", "select"];
/** Messages that change what belongs to the session, which only its host does. @type {ClientMessage["type"][]} */
const OF_HOST = ["acquire", "find_people", "calibration_check", "clocks", "floor", "view_3d", "snap", "observations"];
const DECISIONS = new Set(["verify", "reject", "comment", "resolve", "reopen"]);
/** Messages that the page sends by itself, or many in a row, so that a refusal needs no notice. @type {ClientMessage["type"][]} */
const SILENT = ["watch", "provenance", "pause_3d", "seek", "select", "view_3d"];
const MARKS = new Set(["reviewed", "unreviewed"]);

/**
 * @param {ClientMessage} message
 * @param {import("./protocol.js").SessionMessage} session
 * @returns {boolean} whether the page may send it
 */
export function isAllowed(message, { role, has_place }) {
  if (role === "host" || LOOK.includes(message.type)) return true;
  if (MOVES.includes(message.type)) return has_place;
  if (role === "annotate") return !OF_HOST.includes(message.type) && (message.type !== "body_sizes" || message.action === "couple");
  if (role === "look") return false;
  if (message.type === "annotation") return DECISIONS.has(message.action);
  return message.type === "mark" ? message.toggle === "reviewed" : message.type === "range" && MARKS.has(message.action);
}

/**
 * Say why a message is not allowed.
 *
 * @param {import("./protocol.js").SessionMessage} session
 * @param {import("./protocol.js").PresenceMessage["link"]} link what the page may do once a name is given
 */
export function refusalOf({ role, has_place }, link) {
  if (role === "annotate") return "The host's page changes bodies, cameras, the floor and the 3-D view: ask the host.";
  if (!has_place && link !== "look") return `Give your name first, to ${link}.`;
  return `This link is to ${role}: ask for another to change anything.`;
}

/**
 * @param {ClientMessage} message that is not allowed
 * @returns {boolean} whether a refusal of it needs a notice: the user asked for something
 */
export function isAsked(message) {
  return !SILENT.includes(message.type) && (!("phase" in message) || message.phase === "start");
}
