/** Form that imports results of other programs: paths are read and checked, shown over the pictures, then stored. */

import { make, onSubmit, textButton } from "../widgets/elements.js";
import { count, sentence } from "../widgets/text.js";
import { postJson } from "../widgets/post_json.js";
import { labelled } from "./parts.js";

/**
 * @typedef {{completes: (input: HTMLInputElement) => void}} PathFields gives fields of paths completion and a picker
 * @typedef {{view: string, place: string | null, rows: number, frames: [number, number] | null, most_people: number,
 *   confidence: number | null, share: number | null}} View
 * @typedef {{name: string, format: string, people: string[], are_masks: boolean, frames: number, views: View[], skeleton: string,
 *   points: Record<string, string[]>, matched: number, notes: string[], problems: string[]}} Plan
 */

/** Label and title of each text field by its name: the files and their name, then what they lack. @type {Record<string, [string, string]>} */
const TEXTS = {
  paths: ["Files or folder", "Folder or files on the machine of the program, of one format; several are separated by semicolons"],
  name: ["Name", "Name of the observations in the session"],
  first_frame: ["First frame", "Frame of the session of the first picture or row; by the numbers of the files if empty"],
  offsets: ["Offsets", "Frames by which the key points of a camera are late, such as cam2=3; several are separated by semicolons"],
  picture_size: ["Picture size", "Width x height of the pictures that points or masks are of, such as 1920x1080, if not the footage's; 1x1 for normalized points"],
  confidence: ["Confidence", "Confidence of all points, 0 to 1, where the files have none"],
  names_of_points: ["Names of points", "A known skeleton by whose names, or in whose order, the points are, such as BODY_25B; guessed if empty"],
  axes: ["Axes", "Joints in space: axes of the file that are the session's x, y and z, such as x,-z,y; x,y,z if empty"],
  units: ["Units", "Joints in space: unit of a file that states none: m, cm, mm, in or ft"],
};

/**
 * Frames by camera, of a text such as "cam2=3; cam3=-1".
 * @param {string} text
 */
function offsetsOf(text) {
  const words = text.split(";").map((word) => word.trim()).filter((word) => word);
  const pairs = words.map((word) => /^(.+?)\s*=\s*(-?\d+)$/.exec(word));
  if (pairs.includes(null)) throw new Error(`Expected offsets such as cam2=3, found “${text}”.`);
  return Object.fromEntries(pairs.map((pair) => [pair?.[1], Number(pair?.[2])]));
}

/**
 * @param {import("../model/store.js").Store} store
 * @param {PathFields} paths
 * @param {() => void} discard forgets what was read
 */
export function importForm(store, { completes }, discard) {
  const fold = make("details", "import-form");
  const head = make("summary", { title: "Bring key points, joints or masks of another program into the session" }, "Import…");
  const form = make("form");
  const [paths, name, ...lacking] = Object.entries(TEXTS).map(([name, [text, title]]) => textField(name, text, title));
  const inputOf = (/** @type {string} */ name) => /** @type {HTMLInputElement} */ (form.elements.namedItem(name));
  const textOf = (/** @type {string} */ name) => inputOf(name).value.trim();
  const keep = make("input", { type: "checkbox", name: "unusual" });
  const unusual = labelled("import-field", "Keep unusual points", "Keep points also where they fit no person of the recording, or fit one better in another way", keep);
  const person = make("select", { name: "person" });
  const people = labelled("import-field", "Person", "Person of whom they are", person);
  const check = make("button", { type: "submit", title: "Read and check the files, and show their points over the pictures; nothing is stored" }, "Check");
  const take = textButton("Import", "Store these files with the session", () => void work(storeFiles), { className: "is-primary" });
  const cancel = textButton("Cancel", "Forget these files", () => reset());
  const result = make("div", { className: "import-result", role: "status" });
  const further = make("details", {}, make("summary", { title: "First frame, offsets, size of the pictures, confidence, names, axes and unit" }, "Details that the files lack"), ...lacking, unusual);
  form.append(paths, name, people, further, make("div", "acquisition-work", check, take, cancel), result);
  fold.append(head, form);
  inputOf("paths").dataset.takes = "files";
  completes(inputOf("paths"));

  let isBusy = false;
  /** @type {Plan | null} */
  let plan = null;
  const enable = () => {
    check.disabled = isBusy || !textOf("paths") || !textOf("name");
    take.disabled = isBusy || !plan || plan.problems.length > 0;
    take.hidden = cancel.hidden = plan === null;
  };
  const clear = () => {
    result.replaceChildren();
    if (plan) discard();
    plan = null;
    enable();
  };
  const reset = () => {
    form.reset();
    clear();
    fold.open = false;
  };
  /** @param {() => Promise<void>} run work after which the buttons are those of its outcome */
  const work = async (run) => {
    isBusy = true;
    enable();
    try {
      await run();
    } catch (error) {
      result.replaceChildren(line(String(/** @type {Error} */ (error).message), "is-failed"));
    }
    isBusy = false;
    enable();
  };

  /** The request of the form. @throws {Error} if a text is none of those expected */
  const request = () => {
    const [number, sure, size] = ["first_frame", "confidence", "picture_size"].map(textOf);
    const pixels = /^(\d+)\s*x\s*(\d+)$/.exec(size);
    if (size && !pixels) throw new Error(`Expected a picture size such as 1920x1080, found “${inputOf("picture_size").value}”.`);
    return {
      paths: textOf("paths"),
      name: textOf("name"),
      people: person.value ? [person.value] : (store.facts.session?.people.map((one) => one.name) ?? []),
      first_frame: number ? Number(number) : null,
      offsets: offsetsOf(textOf("offsets")),
      confidence: sure ? Number(sure) : null,
      picture_size: pixels ? [Number(pixels[1]), Number(pixels[2])] : null,
      names_of_points: textOf("names_of_points") || null,
      axes: textOf("axes") || "x,y,z",
      units: textOf("units") || null,
      unusual: keep.checked,
    };
  };
  const read = async () => {
    clear();
    result.replaceChildren(line("Reading the files …"));
    await postJson("observations/plan", request(), (text) => result.replaceChildren(...describe((plan = JSON.parse(text)))));
  };
  const storeFiles = async () => {
    await postJson("observations/import", {});
    plan = null;
    reset();
  };

  onSubmit(form, () => void work(read));
  form.addEventListener("input", clear);
  enable();
  return {
    element: fold,
    open() {
      fold.open = true;
      fold.scrollIntoView({ block: "nearest" });
      inputOf("paths").focus();
    },
    /** Offer the people of the session. */
    show() {
      const names = store.facts.session?.people.map((one) => one.name) ?? [];
      if (names.join() === [...person.options].map((one) => one.value).filter(Boolean).join()) return;
      person.replaceChildren(...(names.length > 1 ? [new Option("all", "")] : []), ...names.map((one) => new Option(one, one)));
    },
  };
}

/** @param {Plan} plan */
function describe(plan) {
  const matched = Object.entries(plan.points).filter(([, own]) => own.length);
  const others = Object.entries(plan.points).filter(([, own]) => !own.length).map(([point]) => point); // prettier-ignore
  const list = make("ul");
  for (const view of plan.views) {
    const what = plan.are_masks ? "people" : "points";
    const frames = view.frames ? `${what} in frames ${view.frames[0]} to ${view.frames[1]}` : `no ${what}`;
    const more = [view.share === null ? "" : `${(100 * view.share).toFixed(1)} % of the picture`, view.most_people > 1 ? `up to ${view.most_people} people` : "", view.confidence === null ? "" : `median confidence ${view.confidence.toFixed(2)}`];
    const words = view.place === null ? ["no files"] : [`${count(view.rows)} ${plan.are_masks ? "masks" : "rows"}`, frames, ...more];
    list.append(make("li", { title: view.place ?? "" }, `${view.view}: ${words.filter(Boolean).join(", ")}`));
  }
  const points = line(`${matched.length} points as ${plan.skeleton} names them${others.length ? `; without a joint of the body: ${others.join(", ")}` : ""}.`);
  points.title = matched.map(([point, own]) => `${point} = ${own.join(" and ")}`).join("\n");
  return [
    line(`${plan.format}, of ${plan.people.join(", ") || "anyone"}:`),
    list,
    ...(plan.are_masks ? [] : [points]),
    ...plan.notes.map((text) => line(`Note: ${text}.`)),
    ...plan.problems.map((text) => line(sentence(text), "is-failed")),
    line(plan.problems.length ? "Nothing can be imported." : plan.are_masks ? "The views show their outlines. The cameras will use these masks as silhouettes. Nothing was stored yet." : "The views show these points. Nothing was stored yet."),
  ];
}

/**
 * @param {string} name
 * @param {string} text
 * @param {string} title
 */
function textField(name, text, title) {
  const input = make("input", { type: "text", className: "query-field", name, autocomplete: "off", spellcheck: false, id: `import-${name}` });
  return labelled("import-field", text, title, make("span", "path-field", input));
}

/**
 * @param {string} text
 * @param {string} [more] class
 */
function line(text, more = "") {
  return make("p", `section-note ${more}`, text);
}
