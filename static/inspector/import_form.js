/** Form that imports results of other programs: paths are read and checked, shown over the pictures, then stored. */

import { make, onSubmit, textButton } from "../widgets/elements.js";
import { capital, count } from "../widgets/text.js";
import { postJson } from "../widgets/post_json.js";
import { labelled } from "./parts.js";

/**
 * @typedef {{completes: (input: HTMLInputElement) => void}} PathFields gives fields of paths completion and a picker
 * @typedef {{view: string, place: string | null, rows: number, frames: [number, number] | null, most_people: number,
 *   confidence: number | null, share: number | null}} View
 * @typedef {{name: string, format: string, people: string[], are_masks: boolean, frames: number, views: View[], skeleton: string,
 *   points: Record<string, string[]>, matched: number, notes: string[], problems: string[]}} Plan
 */

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
export function importForm(store, paths, discard) {
  const fold = make("details", "import-form");
  const head = make("summary", { title: "Bring key points, joints or masks of another program into the session" }, "Import…");
  const form = make("form");
  const path = field("paths", "Files or folder", "Folder or files on the machine of the program, of one format; several are separated by semicolons");
  path.input.dataset.takes = "files";
  const name = field("name", "Name", "Name of the observations in the session");
  const first = field("first_frame", "First frame", "Frame of the session of the first picture or row; by the numbers of the files if empty");
  const late = field("offsets", "Offsets", "Frames by which the key points of a camera are late, such as cam2=3; several are separated by semicolons");
  const size = field("picture_size", "Picture size", "Width x height of the pictures that points or masks are of, such as 1920x1080, if not the footage's; 1x1 for normalized points");
  const confidence = field("confidence", "Confidence", "Confidence of all points, 0 to 1, where the files have none");
  const skeleton = field("names_of_points", "Names of points", "A known skeleton by whose names, or in whose order, the points are, such as BODY_25B; guessed if empty");
  const axes = field("axes", "Axes", "Joints in space: axes of the file that are the session's x, y and z, such as x,-z,y; x,y,z if empty");
  const units = field("units", "Units", "Joints in space: unit of a file that states none: m, cm, mm, in or ft");
  const keep = make("input", { type: "checkbox", name: "unusual" });
  const unusual = labelled("import-field", "Keep unusual points", "Keep points also where they fit no person of the recording, or fit one better in another way", keep);
  const person = make("select", { name: "person" });
  const people = labelled("import-field", "Person", "Person of whom they are", person);
  const check = make("button", { type: "submit", title: "Read and check the files, and show their points over the pictures; nothing is stored" }, "Check");
  const take = textButton("Import", "Store these files with the session", () => void store_(), { className: "is-primary" });
  const cancel = textButton("Cancel", "Forget these files", () => reset());
  const result = make("div", { className: "import-result", role: "status" });
  const further = make("details", {}, make("summary", { title: "First frame, offsets, size of the pictures, confidence, names, axes and unit" }, "Details that the files lack"), first.label, late.label, size.label, confidence.label, skeleton.label, axes.label, units.label, unusual);
  form.append(path.label, name.label, people, further, make("div", "acquisition-work", check, take, cancel), result);
  fold.append(head, form);
  paths.completes(path.input);

  let isBusy = false;
  /** @type {Plan | null} */
  let plan = null;
  const enable = () => {
    check.disabled = isBusy || !path.input.value.trim() || !name.input.value.trim();
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
  const refuse = (/** @type {unknown} */ error) => {
    result.replaceChildren(line(String(/** @type {Error} */ (error).message), "is-failed"));
  };

  const read = async () => {
    clear();
    isBusy = true;
    enable();
    result.replaceChildren(line("Reading the files …"));
    const every = store.facts.session?.people.map((one) => one.name) ?? [];
    const [number, sure] = [first.input.value.trim(), confidence.input.value.trim()];
    const pixels = /^\s*(\d+)\s*x\s*(\d+)\s*$/.exec(size.input.value);
    try {
      if (size.input.value.trim() && !pixels) throw new Error(`Expected a picture size such as 1920x1080, found “${size.input.value}”.`);
      const request = {
        paths: path.input.value.trim(),
        name: name.input.value.trim(),
        people: person.value ? [person.value] : every,
        first_frame: number ? Number(number) : null,
        offsets: offsetsOf(late.input.value),
        confidence: sure ? Number(sure) : null,
        picture_size: pixels ? [Number(pixels[1]), Number(pixels[2])] : null,
        names_of_points: skeleton.input.value.trim() || null,
        axes: axes.input.value.trim() || "x,y,z",
        units: units.input.value.trim() || null,
        unusual: keep.checked,
      };
      await postJson("observations/plan", request, (text) => result.replaceChildren(...describe((plan = JSON.parse(text)))));
    } catch (error) {
      refuse(error);
    }
    isBusy = false;
    enable();
  };
  const store_ = async () => {
    isBusy = true;
    enable();
    try {
      await postJson("observations/import", {});
      plan = null;
      reset();
    } catch (error) {
      refuse(error);
    }
    isBusy = false;
    enable();
  };

  onSubmit(form, () => void read());
  form.addEventListener("input", clear);
  enable();
  return {
    element: fold,
    open() {
      fold.open = true;
      fold.scrollIntoView({ block: "nearest" });
      path.input.focus();
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
    ...plan.problems.map((text) => line(`${capital(text.replace(/\.$/, ""))}.`, "is-failed")),
    line(plan.problems.length ? "Nothing can be imported." : plan.are_masks ? "The views show their outlines. The cameras will use these masks as silhouettes. Nothing was stored yet." : "The views show these points. Nothing was stored yet."),
  ];
}

/**
 * @param {string} name
 * @param {string} text
 * @param {string} title
 */
function field(name, text, title) {
  const input = make("input", { type: "text", className: "query-field", name, autocomplete: "off", spellcheck: false, id: `import-${name}` });
  return { label: labelled("import-field", text, title, make("span", "path-field", input)), input };
}

/**
 * @param {string} text
 * @param {string} [more] class
 */
function line(text, more = "") {
  return make("p", `section-note ${more}`, text);
}
