/** Questions about the plan of annotation that several rooms ask. */

/**
 * @typedef {import("./protocol.js").TaskInfo} Task
 * @typedef {import("./protocol.js").TaskState} TaskState
 * @typedef {{person: number, frame: number}} Place
 * @typedef {"mine" | "open" | "review" | "rejected" | "all"} Filter
 */

/** States of a task, the one that needs work first at the front. @type {TaskState[]} */
export const TASK_STATES = ["rejected", "draft", "annotated", "verified"];

/**
 * Number of tasks in each state.
 *
 * @param {Task[]} tasks
 * @returns {Record<TaskState, number>}
 */
export function countStates(tasks) {
  const counts = { rejected: 0, draft: 0, annotated: 0, verified: 0 };
  for (const { state } of tasks) counts[state] += 1;
  return counts;
}

/**
 * @param {Task[]} tasks
 * @param {Filter} filter `mine`: work left for the annotator, or for anybody; `open`: the same of everybody
 * @param {string} annotator
 */
export function filterTasks(tasks, filter, annotator) {
  const isOpen = (/** @type {Task} */ { state }) => state === "draft" || state === "rejected";
  const tests = {
    mine: (/** @type {Task} */ task) => isOpen(task) && (task.annotator === annotator || task.annotator === ""),
    open: isOpen,
    review: (/** @type {Task} */ { state }) => state === "annotated",
    rejected: (/** @type {Task} */ { state }) => state === "rejected",
    all: () => true,
  };
  return tasks.filter(tests[filter]).sort((a, b) => a.frame - b.frame || a.person - b.person);
}

/**
 * The next task from a place on, round the end; null if all are of that place.
 *
 * @param {Task[]} tasks by frame and person
 * @param {Place} from
 * @param {1 | -1} way
 */
export function nextTask(tasks, from, way) {
  const order = (/** @type {Place} */ { person, frame }) => frame * 2 ** 20 + person;
  const here = order(from);
  const others = tasks.filter((task) => order(task) !== here);
  const ahead = others.filter((task) => way * (order(task) - here) > 0);
  return (way > 0 ? (ahead[0] ?? others[0]) : (ahead.at(-1) ?? others.at(-1))) ?? null;
}

/**
 * @param {Task[]} tasks
 * @param {Place} place
 */
export function tasksAt(tasks, { person, frame }) {
  return tasks.filter((task) => task.person === person && task.frame === frame);
}

/**
 * State of each planned frame: of several tasks the one that needs work first.
 *
 * @param {Task[]} tasks
 */
export function statesByFrame(tasks) {
  /** @type {Map<number, TaskState>} */
  const found = new Map();
  for (const { frame, state } of tasks) {
    const before = found.get(frame);
    if (!before || TASK_STATES.indexOf(state) < TASK_STATES.indexOf(before)) found.set(frame, state);
  }
  return found;
}
