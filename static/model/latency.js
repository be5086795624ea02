/** How long a hand waits: from a pointer's move to the panes that show it. */

const KEPT = 512;

export class Latency {
  /** Milliseconds, the latest last.
   * @type {number[]} */
  latencies = [];
  /** @type {Map<number, number>} */
  #pending = new Map();

  /**
   * @param {number} seq number of the drag message
   * @param {number} moved when the pointer moved
   */
  sent(seq, moved) {
    this.#pending.set(seq, moved);
  }

  /** Forget what an answer is still awaited for: the connection was lost. */
  forget() {
    this.#pending.clear();
  }

  /** @param {number} seq the last drag message that all panes show */
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
