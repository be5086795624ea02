/** Shares of the panes that the user has chosen by moving borders, kept for each session and arrangement. */

import { keep, keptByName } from "./kept_views.js";

/**
 * @typedef {import("./grid_layout.js").Arrangement} Arrangement
 * @typedef {import("./grid_layout.js").Shares} Shares
 * @typedef {{tracks: number[] | null, panes: (number[] | null)[]}} Choice null where nothing was chosen
 */

export class PaneShares {
  #session = "";
  /** @type {Record<string, unknown>} */
  #choices = {};

  /** @param {string} session name of the session */
  open(session) {
    this.#session = session;
    this.#choices = keptByName("pane-shares", session) ?? {};
  }

  /** Whether any border was moved. */
  get isChosen() {
    return Object.keys(this.#choices).length > 0;
  }

  /**
   * @param {Arrangement} arrangement
   * @param {Shares} automatic where nothing was chosen
   * @returns {Shares}
   */
  of(arrangement, automatic) {
    const { tracks, panes } = this.#choice(arrangement);
    return { tracks: tracks ?? automatic.tracks, panes: automatic.panes.map((shares, track) => panes[track] ?? shares) };
  }

  /**
   * @param {Arrangement} arrangement
   * @param {"tracks" | number} of the tracks, or the panes of the track of this index
   * @param {number[] | null} shares null for the automatic ones
   */
  choose(arrangement, of, shares) {
    const { tracks, panes } = this.#choice(arrangement);
    const choice = of === "tracks" ? { tracks: shares, panes } : { tracks, panes: panes.map((one, track) => (track === of ? shares : one)) };
    if (choice.tracks || choice.panes.some(Boolean)) this.#choices[keyOf(arrangement)] = choice;
    else delete this.#choices[keyOf(arrangement)];
    keep("pane-shares", this.#session, this.#choices);
  }

  /** Return to the automatic shares in all arrangements. */
  reset() {
    this.#choices = {};
    keep("pane-shares", this.#session, this.#choices);
  }

  /**
   * @param {Arrangement} arrangement
   * @returns {Choice}
   */
  #choice(arrangement) {
    const { counts } = arrangement;
    const { tracks, panes } = /** @type {Record<string, any>} */ (this.#choices[keyOf(arrangement)] ?? {});
    return {
      tracks: areShares(tracks, counts.length) ? tracks : null,
      panes: counts.map((count, track) => (areShares(panes?.[track], count) ? panes[track] : null)),
    };
  }
}

/** @param {Arrangement} arrangement */
function keyOf({ isColumns, counts }) {
  return `${isColumns ? "columns" : "rows"} ${counts.join(" ")}`;
}

/**
 * @param {unknown} shares
 * @param {number} count
 */
function areShares(shares, count) {
  if (!Array.isArray(shares) || shares.length !== count || !shares.every((one) => Number.isFinite(one) && one > 0)) return false;
  return Math.abs(shares.reduce((total, one) => total + one, 0) - 1) < 1e-3;
}
