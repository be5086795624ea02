/** Zoom of each view, kept by the browser for each session. */

const STORED = "quadrille.views.";

/** @typedef {{zoom?: unknown, u?: unknown, v?: unknown} | null} Choice null for the whole image */

/**
 * @param {string} session name of the session
 * @returns {Record<string, Choice | undefined>} by name of the camera; empty if nothing valid is stored
 */
export function keptViews(session) {
  try {
    const found = JSON.parse(localStorage.getItem(STORED + session) ?? "{}");
    return typeof found === "object" && found ? found : {};
  } catch {
    return {};
  }
}

/**
 * @param {string} session name of the session
 * @param {Record<string, Choice>} views by name of the camera
 */
export function keepViews(session, views) {
  localStorage.setItem(STORED + session, JSON.stringify(views));
}
