/** The counter, the strip of states, and the list of tasks with its filter. */

import { make, textButton } from "../widgets/elements.js";
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
    review.filter = /** @type {Filter} */ (filter.value);
    listed = FEW_LISTED;
    show();
  });
  const list = make("ol", "plan-tasks");
  const more = textButton("More", "List more tasks", () => {
    listed = Infinity;
    show();
  });
  let listed = FEW_LISTED;

  const showProgress = () => {
    const counts = countStates(review.tasks);
    const total = review.tasks.length;
    const details = TASK_STATES.filter((state) => state !== "verified" && counts[state]).map((state) => `${count(counts[state])} ${state}`);
    counter.replaceChildren(make("b", "", `${count(counts.verified)} of ${count(total)} verified`), make("span", "quiet", details.join(", ")));
    strip.setAttribute("aria-label", TASK_STATES.map((state) => `${counts[state]} ${state}`).join(", "));
    strip.replaceChildren(
      ...[...TASK_STATES].reverse().filter((state) => counts[state]).map((state) => {
        const part = make("span", `is-${state}`);
        part.style.flexGrow = String(counts[state]);
        part.title = `${capital(state)}: ${count(counts[state])}`;
        return part;
      }),
    );
    counter.hidden = strip.hidden = filter.hidden = total === 0;
  };

  const show = () => {
    showProgress();
    const found = review.listed;
    const { person, frame } = review.here;
    list.replaceChildren(...found.slice(0, listed).map((task) => entry(task, task.person === person && task.frame === frame)));
    list.hidden = found.length === 0;
    more.hidden = found.length <= listed;
    more.textContent = `${count(found.length - listed)} more`;
    list.querySelector("[aria-current]")?.scrollIntoView({ block: "nearest" });
  };

  /**
   * @param {Task} task
   * @param {boolean} isHere
   */
  const entry = (task, isHere) => {
    const row = make("li");
    const people = store.facts.session?.people ?? [];
    const who = [people.length > 1 ? people[task.person]?.name : "", task.annotator || "anybody"].filter(Boolean).join(", ");
    const words = `${who}${task.is_disagreement ? ", two copies disagree" : ""}${task.comment ? `: ${task.comment}${task.by ? ` (${task.by})` : ""}` : ""}`;
    const go = textButton("", `Go to frame ${task.frame}`, () => visits.go(task));
    go.append(make("span", "observed-frame", String(task.frame)), make("span", "", words), make("span", `plan-state is-${task.state}`, task.state));
    go.dataset.noCommand = "";
    if (isHere) go.setAttribute("aria-current", "true");
    row.append(go);
    return row;
  };

  return { head: [counter, strip], filter, body: [list, more], show };
}
