/** Keys of the plan: tasks, verdicts, the next best click, comments. */

import { command, inArea } from "../widgets/key_matching.js";

/**
 * @param {ReturnType<typeof import("./section.js").annotationSection>} section
 * @param {import("./review.js").Review} review
 * @param {(row?: HTMLElement) => void} reveal opens the section; focuses a control of the row, by default of the section
 */
export function annotationBindings(section, review, reveal) {
  const { whyNoTask: noTask, whyNoVerdict: noVerdict } = review;
  const words = "dataset plan annotation task";
  /** @param {() => void} run what is done in the section, with the proposal of the next click in sight */
  const there = (run) => () => (reveal(section.click.text), run());
  return inArea("Annotation", [
    command("Plan, tasks and comments", words, () => reveal()),
    { keys: ["Alt T"], ...command("Next task", words, () => review.step(1), noTask) },
    command("Previous task", words, () => review.step(-1), noTask),
    { keys: ["Alt K"], ...command("Accept the planned pose", `${words} verify reviewer next`, () => review.accept(), noVerdict) },
    command("Reject the planned pose", `${words} reviewer comment`, () => noVerdict() || there(section.askReason)(), noVerdict),
    command("Next best click", `${words} propose where a correction lowers the expected error most`, there(section.click.ask), section.click.why),
    command("Comment on the selected limb", `${words} remark`, there(() => section.comments.input.focus())),
    command("Plan frames to annotate", `${words} assign every diverse doubted`, () => (reveal(), section.plan.open())),
  ]);
}
