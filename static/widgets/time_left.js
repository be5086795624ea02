/** Estimate how long work still takes from how its share grew lately. */

/**
 * Growth is measured over this time, s, and over this number of steps: steps can take minutes and differ much, but work of
 * many quick ones must follow a change of pace.
 */
const [WINDOW_S, STEPS] = [60, 10];
/** Shortest elapsed time for an estimate, s: the first step often compiles or reads ahead. */
const FIRST_S = 2;

export class TimeLeft {
  #stage = "";
  /** @type {{share: number, time: number}[]} oldest first */
  #samples = [];

  /**
   * Note how much is done.
   *
   * @param {string} stage another stage has another pace
   * @param {number | null} share 0 to 1; null if unknown
   * @param {number} time s
   */
  note(stage, share, time) {
    const last = this.#samples.at(-1);
    if (stage !== this.#stage || share === null || (last && share < last.share)) this.#samples = [];
    this.#stage = stage;
    if (share === null || this.#samples.at(-1)?.share === share) return;
    this.#samples.push({ share, time });
    // One sample before the window stays: its growth reaches into it.
    while (this.#samples.length > STEPS && time - this.#samples[1].time > WINDOW_S) this.#samples.shift();
  }

  /**
   * Time that the rest takes, s; null while unknown.
   *
   * @param {number} time s
   */
  at(time) {
    const [first, last] = [this.#samples[0], this.#samples.at(-1)];
    if (!first || !last || last.time - first.time < FIRST_S) return null;
    const pace = (last.share - first.share) / (last.time - first.time);
    return Math.max(0, (1 - last.share) / pace - (time - last.time));
  }
}

/**
 * Text such as `40 s left`, as exact as an estimate is.
 *
 * @param {number} seconds
 */
export function timeText(seconds) {
  if (seconds < 10) return "a few seconds left"; // steps of five are half of it
  if (seconds < 90) return `${5 * Math.ceil(seconds / 5)} s left`;
  const minutes = Math.ceil(seconds / 60);
  return minutes < 100 ? `${minutes} min left` : `${Math.round(minutes / 60)} h left`;
}
