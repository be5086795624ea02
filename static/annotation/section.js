/** Annotation: the plan, its tasks and verdicts, the next best click, comments, and speed. */

import { make, textButton } from "../widgets/elements.js";
import { capital } from "../widgets/text.js";
import { clickCard } from "./click_card.js";
import { commentList } from "./comment_list.js";
import { lineForm } from "./parts.js";
import { planForm } from "./plan_form.js";
import { speedTable } from "./speed_table.js";
import { taskList } from "./task_list.js";

/**
 * @param {import("../model/index.js").Context} context
 * @param {import("./review.js").Review} review
 * @param {import("./visits.js").Visits} visits
 */
export function annotationSection(context, review, visits) {
  const { store } = context;
  const none = make("p", "section-note", "Nothing is planned yet. Plan the frames of a dataset, annotate them, and let somebody verify them.");
  const tasks = taskList(store, review, visits);
  const next = textButton("Next task", "Go to the next listed task (Alt+T)", () => review.step(1));
  const accept = textButton("Accept", "Verify the pose of the active person here (Alt+K)", () => review.accept());
  const refuse = textButton("Reject …", "Reject the pose here, and say what is to be corrected", () => askReason());
  const leave = textButton("Withdraw", "Take this frame out of the plan", () => review.withdraw(), { id: "plan-withdraw" });
  const buttons = make("div", "plan-buttons", next, accept, refuse, leave);
  const here = make("p", "section-note");
  const reason = lineForm("Correction to be made", "Reject", (text) => {
    reason.form.hidden = true;
    review.reject(text);
  });
  reason.form.hidden = true;
  reason.input.addEventListener("keydown", (event) => {
    if (event.key !== "Escape") return;
    event.stopPropagation();
    reason.clear();
    reason.form.hidden = true;
    reason.input.blur();
  });
  const askReason = () => {
    if (!review.tasksHere().length) return;
    reason.form.hidden = false;
    reason.input.focus();
  };
  const click = clickCard(context, visits);
  const comments = commentList(context, review, visits);
  const speed = speedTable(store);
  const plan = planForm(context);
  plan.element.id = "plan-frames";
  const body = make(
    "div", "acquisition plan", none, ...tasks.head, buttons, here, reason.form, tasks.filter, ...tasks.body,
    make("h4", "click-card", "Next best click"), ...click.elements,
    make("h4", "", "Comments"), ...comments.elements, speed.element, plan.element,
  ); // prettier-ignore

  const showHere = () => {
    const own = review.tasksHere();
    here.textContent = own
      .map(({ state, by, comment, annotator }) => `${capital(state)}${by ? ` by ${by}` : annotator ? `, for ${annotator}` : ""}${comment ? `: ${comment}` : ""}.`)
      .join(" ");
    here.hidden = !own.length;
    here.classList.toggle("is-failed", own.some(({ state }) => state === "rejected"));
    accept.disabled = refuse.disabled = leave.disabled = !own.length;
    next.disabled = !!review.whyNoTask();
    if (!own.length) reason.form.hidden = true;
  };
  const showAll = () => {
    none.hidden = review.tasks().length > 0;
    buttons.hidden = !none.hidden;
    tasks.show();
    reason.offer(review.tasks().map((task) => task.comment));
    comments.show();
    speed.show();
    click.show();
    plan.showPeople();
    showHere();
  };
  tasks.filter.addEventListener("change", showHere);
  showAll();
  let marked = review.here().person; // whose task the list marks

  store.on(["annotation", "session"], showAll);
  store.on(["target"], () => tasks.show());
  store.on(["target", "state"], () => {
    if (review.here().person !== marked) tasks.show();
    marked = review.here().person;
    showHere();
    comments.showPlace();
  });
  const hint = "The plan of a dataset: tasks, verdicts, the next best click, comments";
  return { id: "annotation", title: "Annotation", hint, body, click, plan, comments, askReason };
}
