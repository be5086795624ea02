/** Provenance: where the selected person's pose and each of its joints come from, and the timeline's filter by it. */

import { make, textButton } from "../widgets/elements.js";
import { KINDS, annotatorName, pointPhrases, poseLines } from "../model/provenance.js";
import { tasksAt } from "../model/tasks.js";
import { capital, count, displayName } from "../widgets/text.js";
import { group } from "./parts.js";
import { command } from "../widgets/key_matching.js";
import { NO_OPTIONS, choiceRow, sectionNote } from "./rows.js";

/** @typedef {import("../model/provenance.js").Filter} Filter */

const ALL = "all";
const BY_NAME = "annotator:";
/**
 * @param {import("../model/index.js").Context} context
 * @param {import("../timeline/index.js").TimelineRoom} timeline
 * @returns {import("./inspector.js").Section}
 */
export function provenanceSection({ store, send, actions }, { jumps }) {
  const filter = choiceRow("Filter", "Poses that the timeline shows as usual; it dims the others", NO_OPTIONS, (value) => choose(chosen(value)));
  const step = (/** @type {1 | -1} */ way) => jumps.go("chosen", way);
  const previous = textButton("Previous", "Go to the previous frame of this kind", () => step(-1));
  const next = textButton("Next", "Go to the next frame of this kind", () => step(1));
  const number = make("span", "section-note");
  const steps = group(previous, next, number);
  const pose = make("div");
  const list = make("ul", { className: "provenance-joints", "aria-label": "Joints" });
  const body = make("div", {}, filter.element, steps, pose, list);

  /** @param {Filter | null} wanted */
  const choose = (wanted) => {
    store.set({ provenanceFilter: wanted });
    ask(wanted);
  };
  let asked = JSON.stringify({ person: null, annotators: false });
  /** Ask for what is in sight: the panel, a joint under the pointer, or the filter by annotator. */
  const ask = (wanted = store.facts.provenanceFilter) => {
    const { connected, state, hover, dragging } = store.facts;
    if (!connected || !state || dragging) return;
    const isSeen = body.getClientRects().length > 0;
    const person = hover ? hover.person : isSeen ? state.person : null;
    const annotators = isSeen || wanted?.kind === "annotator";
    const request = JSON.stringify({ person, annotators });
    if (request === asked) return;
    asked = request;
    send({ type: "provenance", person, annotators });
  };
  new ResizeObserver(() => ask()).observe(body);

  const showFilter = () => {
    const { annotators, provenanceFilter } = store.facts;
    const names = new Set((annotators?.people ?? []).flatMap((of) => Object.keys(of)));
    if (provenanceFilter?.kind === "annotator") names.add(provenanceFilter.name);
    filter.fill([
      [ALL, "all poses"],
      ...KINDS.map(({ kind, label }) => [kind, label]),
      ...[...names].sort().map((name) => [BY_NAME + name, `keyframes of ${annotatorName(name)}`]),
    ]);
    filter.show(valueOf(provenanceFilter), provenanceFilter !== null);
    const found = provenanceFilter ? jumps.count("chosen") : 0;
    steps.hidden = provenanceFilter === null;
    previous.disabled = next.disabled = found === 0;
    number.textContent = `${count(found)} ${found === 1 ? "frame" : "frames"}`;
  };

  let listed = "";
  const showPose = () => {
    const { provenance, state, annotation } = store.facts;
    const isOfSelected = !!provenance && provenance.person === state?.person;
    if (!state || (provenance && !isOfSelected)) return; // of a joint under the pointer: the panel stays as it is
    const isKnown = isOfSelected && provenance.source !== null;
    const lines = isKnown ? poseLines(provenance, tasksAt(annotation?.tasks ?? [], provenance)) : provenance ? ["No pose is stored on this frame."] : [];
    const joints = isKnown ? grouped(provenance) : [];
    const news = JSON.stringify([lines, joints, state.point]);
    if (news === listed) return;
    listed = news;
    pose.replaceChildren(...lines.map(sectionNote));
    list.replaceChildren(...joints.map(([text, points]) => originRow(text, points, state.point, (point) => actions.selectPerson(state.person, point))));
    list.hidden = joints.length === 0;
  };
  showFilter();
  store.on(["connected"], () => (asked = store.facts.connected ? asked : ""));
  store.on(["session"], () => store.set({ provenanceFilter: null }));
  store.on(["hover", "dragging", "state", "connected"], () => ask());
  store.on(["provenance", "annotators", "annotation", "state", "session", "connected", "timeline", "provenanceFilter"], () => {
    showFilter();
    showPose();
  });
  const bindings = (/** @type {() => void} */ reveal) => {
    const choice = (/** @type {string} */ label, /** @type {import("../model/provenance.js").Filter | null} */ wanted) =>
      command(label, "provenance timeline dim source made", () => (reveal(), choose(wanted)));
    return [
      ...KINDS.map(({ kind, label }) => choice(`Filter the timeline: poses ${label}`, { kind })),
      choice("Filter the timeline: all poses", null),
    ];
  };
  const hint = "Origin of this pose and of each joint; filter the timeline by it";
  return { id: "provenance", title: "Provenance", hint, body, bindings };
}

/**
 * Joints of the same origin together, in the order of the body: the words for it, and the names of its points.
 *
 * @param {import("../model/protocol.js").ProvenanceMessage} pose
 */
function grouped(pose) {
  /** @type {Map<string, string[]>} */
  const found = new Map();
  for (const point of pose.points) {
    const text = pointPhrases(point, pose).join(", ");
    found.set(text, [...(found.get(text) ?? []), point.point]);
  }
  return [...found];
}

/**
 * @param {string} text
 * @param {string[]} points
 * @param {string | null} selected
 * @param {(point: string) => void} select
 */
function originRow(text, points, selected, select) {
  const names = points.map((point) => {
    const name = textButton(displayName(point), `Select the ${displayName(point)}`, () => select(point), { "data-no-command": "" });
    if (point === selected) name.setAttribute("aria-current", "true");
    return name;
  });
  return make("li", {}, make("span", {}, capital(text)), make("span", "provenance-points", ...names));
}

/** @param {Filter | null} filter */
function valueOf(filter) {
  return filter === null ? ALL : filter.kind === "annotator" ? BY_NAME + filter.name : filter.kind;
}

/**
 * @param {string} value of the choice
 * @returns {Filter | null}
 */
function chosen(value) {
  if (value.startsWith(BY_NAME)) return { kind: "annotator", name: value.slice(BY_NAME.length) };
  const found = KINDS.find(({ kind }) => kind === value);
  return found ? { kind: found.kind } : null;
}
