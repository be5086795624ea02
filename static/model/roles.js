/** Messages that a page with a shared link sends. The program refuses all others, too (app/page/message_parsing.py). */

/** @typedef {import("./protocol.js").ClientMessage} ClientMessage */

/** @type {ClientMessage["type"][]} */
const LOOK = ["view", "epipolar", "curves", "history"];
/** @type {ClientMessage["type"][]} */
const REVIEW = [...LOOK, "seek", "select"];
/** Messages that the page sends by itself, or many in a row: nobody has to be told. @type {ClientMessage["type"][]} */
const SILENT = ["watch", "pause_3d", "seek", "select", "view_3d"];
const MARKS = new Set(["reviewed", "unreviewed"]);

/**
 * @param {ClientMessage} message
 * @param {import("./protocol.js").SessionMessage["role"]} role
 * @returns {boolean} whether the role may send it
 */
export function isAllowed(message, role) {
  if (role === "annotate") return true;
  if ((role === "review" ? REVIEW : LOOK).includes(message.type)) return true;
  if (role === "look") return false;
  return message.type === "mark" ? message.toggle === "reviewed" : message.type === "range" && MARKS.has(message.action);
}

/**
 * @param {ClientMessage} message that is not allowed
 * @returns {boolean} whether the user asked for something by it, and is told why nothing happens
 */
export function isAsked(message) {
  return !SILENT.includes(message.type) && (!("phase" in message) || message.phase === "start");
}
