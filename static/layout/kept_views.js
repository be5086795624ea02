/** Views of each session that the browser keeps. */

import { store, stored } from "../widgets/stored.js";

/**
 * @typedef {"views" | "filled-pane" | "pane-shares" | "drawer"} Kind zoom of each view by the name of its camera; name of the
 *   camera whose pane fills the grid, or null; shares of the panes by arrangement; open tab of the drawer, or null
 */

/**
 * @param {Kind} kind
 * @param {string} session name of the session
 * @returns {unknown} undefined if nothing valid is stored
 */
export function kept(kind, session) {
  return stored(keyOf(kind, session));
}

/**
 * As `kept`, for what is kept by name.
 *
 * @param {Kind} kind
 * @param {string} session name of the session
 * @returns {Record<string, unknown> | null} null if nothing valid is stored
 */
export function keptByName(kind, session) {
  const found = kept(kind, session);
  return typeof found === "object" && !Array.isArray(found) ? /** @type {Record<string, unknown> | null} */ (found) : null;
}

/**
 * @param {Kind} kind
 * @param {string} session name of the session
 * @param {unknown} value
 */
export function keep(kind, session, value) {
  store(keyOf(kind, session), value);
}

/**
 * @param {Kind} kind
 * @param {string} session
 */
function keyOf(kind, session) {
  return `quadrille.${kind}.${session}`;
}
