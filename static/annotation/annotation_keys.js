/** Keys of the plan: tasks, verdicts, the next best click, comments. */

import { inArea } from "../widgets/key_matching.js";

/**
 * @param {ReturnType<typeof import("./section.js").annotationSection>} section
 * @param {import("./review.js").Review} review
 * @param {(row?: HTMLElement) => void} reveal opens the section; focuses a control of the row, by default of the section
 */
export function annotationBindings(section, review, reveal) {
  const { whyNoTask: noTask, whyNoVerdict: noVerdict } = review;
  const words = "dataset plan annotation task";
  return inArea("Annotation", [
    { label: "Plan, tasks and comments", words, run: () => reveal() },
    { keys: ["Alt T"], label: "Next task", words, why: noTask, run: () => review.step(1) },
    { label: "Previous task", words, why: noTask, run: () => review.step(-1) },
    { keys: ["Alt K"], label: "Accept the planned pose", words: `${words} verify reviewer next`, why: noVerdict, run: () => review.accept() },
    {
      label: "Reject the planned pose",
      words: `${words} reviewer comment`,
      why: noVerdict,
      run: () => {
        if (noVerdict()) return;
        reveal(section.click.text);
        section.askReason();
      },
    },
    {
      label: "Next best click",
      words: `${words} propose where a correction lowers the expected error most`,
      why: section.click.why,
      run: () => {
        reveal(section.click.text);
        section.click.ask();
      },
    },
    {
      label: "Comment on the selected limb",
      words: `${words} remark`,
      run: () => {
        reveal(section.click.text);
        section.comments.input.focus();
      },
    },
    {
      label: "Plan frames to annotate",
      words: `${words} assign every diverse doubted`,
      run: () => {
        reveal();
        section.plan.open();
      },
    },
  ]);
}
