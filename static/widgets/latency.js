/** Measure the time from a pointer move to the panes that show it. */

const KEPT = 512;

export class Latency {
  /** Milliseconds, newest last.
   * @type {number[]} */
  latencies = [];
  /** @type {Map<number, number>} */
  #pending = new Map();

  /**
   * @param {number} seq number of the drag message
   * @param {number} moved time of the pointer move
   */
  sent(seq, moved) {
    this.#pending.set(seq, moved);
  }

  /** Discard pending measurements after the connection is lost. */
  forget() {
    this.#pending.clear();
  }

  /** @param {number} seq number of the last drag message that all panes show */
  painted(seq) {
    const now = performance.now();
    for (const [number, moved] of this.#pending) {
      if (number > seq) break;
      this.#pending.delete(number);
      this.latencies.push(now - moved);
    }
    this.latencies.splice(0, this.latencies.length - KEPT);
  }
}
