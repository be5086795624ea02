/** The form that plans frames: which, of whom, and for whom. */

import { make, onSubmit } from "../widgets/elements.js";
import { labelled } from "../inspector/parts.js";
import { fold } from "./parts.js";

/** @type {[string, string][]} */
const WAYS = [
  ["every", "Every n-th frame"],
  ["frames", "These frames"],
  ["diverse", "Most diverse poses"],
  ["doubted", "Doubtful or lost poses"],
];

/** @param {import("../model/index.js").Context} context */
export function planForm({ store, send, say }) {
  const way = select("Frames", WAYS);
  const number = field("N", "15", "Distance of the frames, or number of poses");
  const frames = field("List", "0,40,100:110", "Frames and ranges; the end of a range is not included");
  const person = select("Of", []);
  const to = field("To", "anybody", "Names of the annotators, with commas; the frames are dealt out in turns");
  const each = make("input", { type: "checkbox" });
  const eachLabel = make("label", { className: "plan-check", title: "Give all frames to each annotator instead" }, each, "all frames to each");
  const plan = make("button", { className: "is-primary", type: "submit", title: "Add these frames to the plan; tasks that are there already stay" }, "Plan");
  const form = make("form", "plan-form", way.label, number.label, frames.label, person.label, to.label, eachLabel, plan);
  number.input.inputMode = "numeric";

  const names = () => to.input.value.split(",").map((name) => name.trim()).filter(Boolean); // prettier-ignore
  const enable = () => {
    number.label.hidden = !["every", "diverse"].includes(way.input.value);
    frames.label.hidden = way.input.value !== "frames";
    eachLabel.hidden = names().length < 2;
  };
  const refuse = (/** @type {string} */ text) => say(text, "error");
  form.addEventListener("input", enable);
  onSubmit(form, () => {
    const by = /** @type {import("../model/protocol.js").PlanTasks["by"]} */ (way.input.value);
    const n = number.label.hidden ? 1 : Number(number.input.value.trim() || number.input.placeholder);
    if (!Number.isInteger(n) || n < 1 || n > 100000) return refuse(`Expected a whole number from 1, found “${number.input.value}”.`);
    if (by === "frames" && !frames.input.value.trim()) return refuse("Expected frames such as 0,40,100:110, found none.");
    const who = person.input.value === "" ? null : Number(person.input.value);
    send({ type: "annotation", action: "plan", by, n, frames: frames.input.value.trim(), person: who, to: names(), each: each.checked });
  });
  enable();
  const element = fold("Plan frames", "Choose the frames that are to be annotated, and by whom", form);

  return {
    element,
    open() {
      element.open = true;
      element.scrollIntoView({ block: "nearest" });
      way.input.focus();
    },
    /** Offer the people of the session. */
    showPeople() {
      const people = store.facts.session?.people.map(({ name }) => name) ?? [];
      person.label.hidden = people.length < 2;
      if (people.length + 1 === person.input.options.length) return;
      person.input.replaceChildren(new Option("everybody", ""), ...people.map((name, index) => new Option(name, String(index))));
    },
  };
}

/**
 * @param {string} text
 * @param {[string, string][]} options
 */
function select(text, options) {
  const input = make("select", { "aria-label": text }, ...options.map(([value, words]) => new Option(words, value)));
  return { label: labelled("plan-field", text, "", input), input };
}

/**
 * @param {string} text
 * @param {string} placeholder
 * @param {string} title
 */
function field(text, placeholder, title) {
  const input = make("input", { className: "query-field", type: "text", placeholder, autocomplete: "off", spellcheck: false });
  return { label: labelled("plan-field", text, title, input), input };
}
