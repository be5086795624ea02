/** Other copy: the poses of another annotator's copy of the session beside the own ones, and the choice between them. */

import { make, onSubmit, textButton } from "../widgets/elements.js";
import { postJson } from "../widgets/post_json.js";
import { copyDifferences, differenceAt } from "../model/selectors.js";
import { count, displayName } from "../widgets/text.js";
import { group, jointRow, labelled, longList } from "./parts.js";
import { command } from "../widgets/key_matching.js";
import { numberRow, sectionNote } from "./rows.js";

/**
 * @typedef {import("../model/protocol.js").UseCopy["action"]} Action
 * @typedef {import("../model/selectors.js").Difference} Difference
 */

/** Entries of the list that are built at first, and after "more". */
const FEW_LISTED = 20;
const NO_COPY = "No copy is compared. Open one first.";

/**
 * @param {import("../model/index.js").Context} context
 * @param {import("../timeline/index.js").TimelineRoom} timeline
 * @param {import("./import_form.js").PathFields} paths
 * @returns {import("./inspector.js").Section}
 */
export function copySection({ store, send, say, navigation, actions }, { jumps }, paths) {
  const decide = (/** @type {Action} */ action) => {
    const { state } = store.facts;
    if (state) send({ type: "other_copy", action, person: state.person, frame: state.frame });
  };
  const leaveCopy = () => send({ type: "other_copy", action: "leave", person: 0, frame: 0 });
  const input = make("input", { type: "text", className: "query-field", name: "copy", id: "copy-folder", "data-takes": "folder" });
  const title = "Folder of another annotator's copy of this session, on the machine of the program";
  const label = labelled("import-field", "Folder", title, make("span", "path-field", input));
  const open = make("button", { type: "submit", title: "Read the poses of this copy, and show where both differ; nothing is changed" }, "Compare");
  const answer = make("p", { className: "section-note", role: "status" });
  const form = make("form", "copy-form", label, open);
  paths.completes(input);

  const summary = sectionNote();
  const here = sectionNote();
  const tolerance = numberRow("Tolerance", "Distance of a joint up to which two poses count as one", {
    unit: "mm",
    low: 0,
    high: 10000,
    step: 5,
    change: (value) => value !== null && send({ type: "other_copy", action: "tolerance", tolerance_mm: value }),
    refuse: say,
  });
  const keep = textButton("Keep mine", "Keep this session's pose as a keyframe, and count the difference as decided", () => decide("keep"));
  const take = textButton("Take theirs", "Take the pose of the other copy as a keyframe; can be undone", () => decide("take"));
  const mean = textButton("Mean", "Take the mean of both poses as a keyframe: angles the shorter way round; can be undone", () => decide("mean"));
  const buttons = group(keep, take, mean);
  const previous = textButton("Previous", "Previous frame where the copies differ", () => step(-1));
  const next = textButton("Next", "Next frame where the copies differ", () => step(1));
  const ways = group(previous, next, textButton("End", "End the comparison; nothing is changed", leaveCopy));
  const worst = make("ol", { className: "observed-worst", "aria-label": "Differences, largest first" });
  const differences = longList(worst, FEW_LISTED, "List smaller differences too", (/** @type {Difference} */ one) => {
    const { session, state } = store.facts;
    const cells = /** @type {[string, string]} */ ([displayName(one.joint), `${Math.round(one.distance_mm)} mm`]);
    return jointRow(session?.people ?? [], one, one.frame === state?.frame, () => visit(one), cells);
  });
  const compared = make("div", "acquisition", summary, tolerance.element, ways, here, buttons, ...differences.elements);
  const body = make("div", "acquisition", form, answer, compared);

  let isBusy = false;
  let listed = "";
  const refuse = (/** @type {string} */ text) => {
    answer.textContent = text;
    answer.classList.toggle("is-failed", text !== "");
    answer.hidden = !text;
  };
  const read = async () => {
    isBusy = true;
    refuse("");
    show();
    try {
      await postJson("copies/open", { folder: input.value.trim() });
    } catch (error) {
      refuse(String(/** @type {Error} */ (error).message));
    }
    isBusy = false;
    show();
  };
  onSubmit(form, () => {
    if (input.value.trim()) void read();
  });
  form.addEventListener("input", () => show());

  /** @param {Difference} found */
  const visit = ({ person, frame, joint }) => {
    const info = store.facts.session?.people[person];
    navigation.pause();
    navigation.goTo(frame);
    actions.selectPerson(person, info?.points.includes(joint) ? joint : null);
  };
  const step = (/** @type {1 | -1} */ way) => {
    jumps.go("copy", way);
    const at = copyDifferences(store.facts).find(({ frame }) => frame === store.facts.target);
    if (at) visit(at);
  };

  const show = () => {
    const { otherCopy: copy, connected, session, state } = store.facts;
    open.disabled = isBusy || !connected || !input.value.trim();
    open.textContent = isBusy ? "Reading …" : "Compare";
    compared.hidden = !copy;
    form.hidden = !!copy;
    if (!copy || !session || !state) return;
    const apart = copyDifferences(store.facts).sort((a, b) => b.distance_mm - a.distance_mm);
    const all = copy.people.flat();
    const decided = all.filter((one) => one.decided).length;
    summary.textContent =
      `${copy.own_name} and ${copy.name}: ${count(all.length)} ${all.length === 1 ? "pose was" : "poses were"} annotated by both. ` +
      `${count(apart.length)} ${apart.length === 1 ? "differs" : "differ"} by more than the tolerance${decided ? `, ${count(decided)} decided` : ""}.` +
      copy.notes.map((text) => ` Note: ${text}.`).join("");
    tolerance.show(copy.tolerance_mm);
    previous.disabled = next.disabled = apart.length === 0;
    const found = differenceAt(store.facts, state.person, state.frame);
    const isPosed = copy.posed[state.person] ?? false;
    const isOwn = state.source !== null;
    keep.disabled = !isOwn || !isPosed;
    take.disabled = !isPosed;
    mean.disabled = !isPosed || !isOwn;
    here.textContent = found
      ? `Frame ${state.frame}: the ${displayName(found.joint)} is ${Math.round(found.distance_mm)} mm apart${found.decided ? ", decided" : ""}.`
      : isPosed
        ? `Frame ${state.frame}: the other pose is drawn; not annotated by both.`
        : `Frame ${state.frame}: ${copy.name} has no pose.`;
    const news = JSON.stringify([apart, state.frame]);
    if (news !== listed) differences.show(apart);
    listed = news;
  };
  refuse("");
  show();
  store.on(["otherCopy", "state", "session", "connected"], show);
  const bindings = (/** @type {() => void} */ reveal) => {
    const noCopy = () => (store.facts.otherCopy ? null : NO_COPY);
    const none = () => noCopy() ?? (copyDifferences(store.facts).length ? null : "The copies differ nowhere by more than the tolerance.");
    const off = (/** @type {HTMLButtonElement} */ which) => () => noCopy() ?? (which.disabled ? here.textContent : null);
    const words = "annotator agreement copy compare disagreement difference";
    return [
      command("Compare with another copy of the session…", words, () => (reveal(), input.focus())),
      command("Other copy: keep my pose", words, () => decide("keep"), off(keep)),
      command("Other copy: take their pose", words, () => decide("take"), off(take)),
      command("Other copy: take the mean of both poses", words, () => decide("mean"), off(mean)),
      command("Other copy: go to the largest difference", words, () => {
        reveal();
        const [largest] = copyDifferences(store.facts).sort((a, b) => b.distance_mm - a.distance_mm);
        visit(largest);
      }, none),
      command("End the comparison with the other copy", words, leaveCopy, noCopy),
    ];
  };
  const hint = "Compare with another annotator's copy of this session, and decide where both differ";
  return { id: "copy", title: "Other copy", hint, body, bindings };
}
