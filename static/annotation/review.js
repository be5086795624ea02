/** The way through the plan, and verdicts on planned poses. A verdict never changes a pose. */

import { filterTasks, nextTask, tasksAt } from "../model/tasks.js";

/** @typedef {import("../model/tasks.js").Filter} Filter */

const NO_PLAN = "Nothing is planned. Plan frames in the inspector, section Annotation.";

/** @typedef {ReturnType<typeof makeReview>} Review */

/**
 * @param {import("../model/index.js").Context} context
 * @param {import("./visits.js").Visits} visits
 */
export function makeReview(context, visits) {
  /** @type {Filter} tasks that are listed and gone through */
  let filter = "mine";
  const { facts } = context.store;
  const tasks = () => facts.annotation?.tasks ?? [];

  /** The tasks of the filter, by frame. */
  const listed = () => filterTasks(tasks(), filter, facts.annotation?.annotator ?? "");

  /** The active person on the requested frame. */
  const here = () => ({ person: facts.state?.person ?? 0, frame: facts.target });
  const tasksHere = () => tasksAt(tasks(), here());

  /** Why there is no task to go to; null if there is one. */
  function whyNoTask() {
    if (!tasks().length) return NO_PLAN;
    return listed().length ? null : "No task is listed. Choose other tasks in the inspector, section Annotation.";
  }

  /** Why there is nothing to decide on; null if there is something. */
  function whyNoVerdict() {
    if (!tasks().length) return NO_PLAN;
    return tasksHere().length ? null : "No task of the active person is planned on this frame.";
  }

  /** @param {1 | -1} way */
  function step(way) {
    const task = nextTask(listed(), here(), way);
    if (task) visits.go(task);
    else context.say("This is the only listed task.");
  }

  /**
   * Decide on the tasks here, and show the next planned pose that nobody has reviewed.
   *
   * @param {"verify" | "reject" | "withdraw"} action
   * @param {string} comment
   */
  function decide(action, comment) {
    const [place, task] = [here(), tasksHere()[0]];
    if (!task) return;
    context.send({ type: "annotation", action, ...place, comment, pose: task.pose }); // the pose of all tasks here
    if (action === "withdraw") return;
    const next = nextTask(filterTasks(tasks(), "review", ""), place, 1);
    if (next) visits.go(next);
    else context.say("No annotated pose is left to review.");
  }

  return {
    tasks,
    listed,
    here,
    tasksHere,
    whyNoTask,
    whyNoVerdict,
    step,
    /** @param {Filter} chosen */
    list: (chosen) => (filter = chosen),
    accept: () => decide("verify", ""),
    /** @param {string} comment what is to be corrected */
    reject: (comment) => decide("reject", comment),
    withdraw: () => decide("withdraw", ""),
  };
}
