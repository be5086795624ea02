/** The counter, the strip of states, and the list of tasks with its filter. */

import { frameRow, longList } from "../inspector/parts.js";
import { make } from "../widgets/elements.js";
import { TASK_STATES, countStates } from "../model/tasks.js";
import { capital, count } from "../widgets/text.js";

/**
 * @typedef {import("../model/tasks.js").Task} Task
 * @typedef {import("../model/tasks.js").Filter} Filter
 */

/** Entries of the list that are built at first, and after "more". */
const FEW_LISTED = 40;

/** @type {[Filter, string][]} */
const FILTERS = [
  ["mine", "Mine, to be done"],
  ["open", "Open, of all"],
  ["review", "To be reviewed"],
  ["rejected", "Rejected"],
  ["all", "All"],
];

/**
 * @param {import("../model/store.js").Store} store
 * @param {import("./review.js").Review} review
 * @param {import("./visits.js").Visits} visits
 */
export function taskList(store, review, visits) {
  const counter = make("p", "plan-counter");
  const strip = make("div", { className: "plan-strip", role: "img" });
  const filter = make("select", { "aria-label": "Tasks to list and to go through", title: "Tasks to list and to go through" }, ...FILTERS.map(([value, text]) => new Option(text, value)));
  filter.addEventListener("change", () => {
    review.list(/** @type {Filter} */ (filter.value));
    show(true);
  });
  const list = make("ol", "plan-tasks");
  const tasks = longList(list, FEW_LISTED, "List more tasks", (/** @type {Task} */ task) => {
    const { person, frame } = review.here();
    const people = store.facts.session?.people ?? [];
    const who = [people.length > 1 ? people[task.person]?.name : "", task.annotator || "anybody"].filter(Boolean).join(", ");
    const words = `${who}${task.is_disagreement ? ", two copies disagree" : ""}${task.comment ? `: ${task.comment}${task.by ? ` (${task.by})` : ""}` : ""}`;
    const state = make("span", `plan-state is-${task.state}`, task.state);
    const isHere = task.person === person && task.frame === frame;
    return frameRow(task.frame, isHere, `Go to frame ${task.frame}`, () => visits.go(task), make("span", {}, words), state);
  });

  const showProgress = () => {
    const counts = countStates(review.tasks());
    const total = review.tasks().length;
    const details = TASK_STATES.filter((state) => state !== "verified" && counts[state]).map((state) => `${count(counts[state])} ${state}`);
    counter.replaceChildren(make("b", "", `${count(counts.verified)} of ${count(total)} verified`), make("span", "quiet", details.join(", ")));
    strip.setAttribute("aria-label", TASK_STATES.map((state) => `${counts[state]} ${state}`).join(", "));
    strip.replaceChildren(
      ...[...TASK_STATES].reverse().filter((state) => counts[state]).map((state) => {
        const part = make("span", { className: `is-${state}`, title: `${capital(state)}: ${count(counts[state])}` });
        part.style.flexGrow = String(counts[state]);
        return part;
      }),
    );
    counter.hidden = strip.hidden = filter.hidden = total === 0;
  };

  const show = (isNew = false) => {
    showProgress();
    tasks.show(review.listed(), isNew);
    list.querySelector("[aria-current]")?.scrollIntoView({ block: "nearest" });
  };

  return { head: [counter, strip], filter, body: tasks.elements, show };
}
