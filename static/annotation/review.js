/** The way through the plan, and verdicts on planned poses. A verdict never changes a pose. */

import { filterTasks, nextTask, tasksAt } from "../model/tasks.js";

/** @typedef {import("../model/tasks.js").Filter} Filter */

const NO_PLAN = "Nothing is planned. Plan frames in the inspector, section Annotation.";

export class Review {
  #context;
  #visits;
  /** @type {Filter} tasks that are listed and gone through */
  filter = "mine";

  /**
   * @param {import("../model/index.js").Context} context
   * @param {import("./visits.js").Visits} visits
   */
  constructor(context, visits) {
    this.#context = context;
    this.#visits = visits;
  }

  get #facts() {
    return this.#context.store.facts;
  }

  get tasks() {
    return this.#facts.annotation?.tasks ?? [];
  }

  /** The tasks of the filter, by frame. */
  get listed() {
    return filterTasks(this.tasks, this.filter, this.#facts.annotation?.annotator ?? "");
  }

  /** The active person on the requested frame. */
  get here() {
    return { person: this.#facts.state?.person ?? 0, frame: this.#facts.target };
  }

  get tasksHere() {
    return tasksAt(this.tasks, this.here);
  }

  /** Why there is no task to go to; null if there is one. */
  get whyNoTask() {
    if (!this.tasks.length) return NO_PLAN;
    return this.listed.length ? null : "No task is listed. Choose other tasks in the inspector, section Annotation.";
  }

  /** Why there is nothing to decide on; null if there is something. */
  get whyNoVerdict() {
    if (!this.tasks.length) return NO_PLAN;
    return this.tasksHere.length ? null : "No task of the active person is planned on this frame.";
  }

  /** @param {1 | -1} way */
  step(way) {
    const task = nextTask(this.listed, this.here, way);
    if (task) this.#visits.go(task);
    else this.#context.say("This is the only listed task.");
  }

  accept() {
    this.#decide("verify", "");
  }

  /** @param {string} comment what is to be corrected */
  reject(comment) {
    this.#decide("reject", comment);
  }

  withdraw() {
    this.#decide("withdraw", "");
  }

  /**
   * Decide on the tasks here, and show the next planned pose that nobody has reviewed.
   *
   * @param {"verify" | "reject" | "withdraw"} action
   * @param {string} comment
   */
  #decide(action, comment) {
    const { person, frame } = this.here;
    if (!this.tasksHere.length) return;
    const [{ pose }] = this.tasksHere; // of all tasks here
    this.#context.send({ type: "annotation", action, person, frame, comment, pose });
    if (action === "withdraw") return;
    const next = nextTask(filterTasks(this.tasks, "review", ""), { person, frame }, 1);
    if (next) this.#visits.go(next);
    else this.#context.say("No annotated pose is left to review.");
  }
}
