/** Status and provenance of the poses of the shown frame, and the remarks and comments of all frames. */

import { data, poseOf } from "./data.js";
import { make } from "../widgets/elements.js";
import { byId } from "./dom.js";
import { follow, seek, shown } from "./player.js";

const SOURCES = { manual: "set by hand", pinned: "fitted to pins", fitted: "fitted", searched: "found by a search" };

/**
 * Return the pose of a person in words.
 *
 * @param {import("./data.js").Pose} pose
 */
const words = (pose) => {
  const source = Reflect.get(SOURCES, pose.source) ?? pose.source;
  const marks = [pose.keyframe ? "keyframe" : pose.status || "not assessed", source];
  if (pose.reviewed && !pose.keyframe) marks.push("reviewed");
  return marks.join(", ");
};

const drawDetails = () => {
  const parts = data.people.flatMap((person) => {
    const pose = poseOf(person, shown().at);
    const title = make("h2", { "--person": person.color }, person.name);
    if (!pose) return [title, make("p", "muted", "no pose")];
    const day = pose.time.slice(0, 10);
    const made = `${pose.body}; calibration ${pose.calibration}; ${day}, Quadrille ${pose.program}`;
    const remark = pose.remark ? [make("p", {}, pose.remark)] : [];
    return [title, make("p", {}, words(pose)), ...remark, make("p", "muted", made)];
  });
  byId("details").replaceChildren(...parts);
};

/** Remarks of each person, those of frames that follow one another joined. */
const remarks = () =>
  data.people.flatMap((person) => {
    /** @type {{ person: string, first: number, last: number, text: string }[]} */
    const found = [];
    data.frames.forEach((_frame, at) => {
      const text = poseOf(person, at)?.remark;
      const before = found.at(-1);
      if (!text) return;
      if (before && before.text === text && before.last === at - 1) before.last = at;
      else found.push({ person: person.name, first: at, last: at, text });
    });
    return found;
  });

/** Comments of people, as remarks. */
const comments = () =>
  data.comments.map(({ person, frame, limb, text, author, resolved }) => {
    const at = data.frames.indexOf(frame);
    const words = [author, limb].filter(Boolean).join(", ");
    return { person, first: at, last: at, text: `${words && `${words}: `}“${text}”${resolved ? ", resolved" : ""}` };
  });

/** Make the list of remarks and comments, and the details that follow the frame. */
export const mountDetails = () => {
  const found = [...comments(), ...remarks()].sort((a, b) => a.first - b.first);
  const rows = found.map(({ person, first, last, text }) => {
    const [from, to] = [data.frames[first], data.frames[last]];
    const who = data.people.length > 1 ? `${person}, ` : "";
    return make("li", {}, make("button", { onclick: () => seek(first) }, `${from}${to > from ? `–${to}` : ""}: ${who}${text}`));
  });
  byId("remarks").replaceChildren(make("h2", {}, found.length ? "Remarks and comments" : "No remarks"), make("ul", {}, ...rows));
  follow(drawDetails);
};
