/** Body sizes of the active person: first a draft that the views outline, then the body, as an entry of the history. */

import { make, textButton } from "../widgets/elements.js";
import { capital, displayName } from "../widgets/text.js";
import { acquisitionView } from "./acquisition_view.js";
import { boundedField, checkRow, choiceRow, numberRow } from "./rows.js";

/**
 * @typedef {import("../model/protocol.js").BodySizesMessage} BodySizes
 * @typedef {import("../model/protocol.js").PartSizes} PartSizes
 * @typedef {"length_m" | "half_depth_m" | "half_width_m"} SizeName
 * @typedef {ReturnType<typeof boundedField>} Field
 */

/** @type {{name: SizeName, head: string, factor: number, title: string}[]} factor: from metres to the centimetres shown */
const SIZES = [
  { name: "length_m", head: "Length", factor: 100, title: "length between its joints, cm" },
  { name: "half_depth_m", head: "Depth", factor: 200, title: "thickness from front to back at its middle, cm" },
  { name: "half_width_m", head: "Width", factor: 200, title: "thickness from side to side at its middle, cm" },
];
const STEP_CM = 0.5;

export class BodySection {
  id = "body";
  title = "Body sizes";
  hint = "Lengths and girths of the active person; acquire them from the footage";
  body = make("div");
  #store;
  #send;
  #refuse;
  #person = make("p", "person-name is-clipped");
  #model;
  #height;
  #alike;
  #table = make("div", "size-table");
  #keyframes;
  #apply;
  #discard;
  #former;
  #note = make("p", { className: "section-note", role: "status" });
  #acquisition;
  /** @type {{field: Field, read: (sizes: BodySizes) => number | undefined, factor: number}[]} */
  #fields = [];
  #built = "";

  /** @param {import("../model/index.js").Context} context */
  constructor(context) {
    const { store, send, say } = context;
    this.#acquisition = acquisitionView(context);
    this.#store = store;
    this.#send = send;
    this.#refuse = say;
    this.#model = choiceRow({
      label: "Body",
      title:
        "Joints and parts of the person, such as feet. Sizes that both bodies have stay, and keyframes are fitted. " +
        "Tracked poses keep the former body until tracked again. Can be undone",
      options: /** @type {[string, string][]} */ ([]),
      change: (to) => this.#edit({ action: "body", to }),
    });
    this.#height = numberRow({
      label: "Height",
      title: "Body height; all other sizes scale with it",
      unit: "cm",
      low: 30,
      high: 300,
      step: 1,
      change: (value) => value !== null && this.#edit({ action: "height", height_m: value / 100 }),
      refuse: this.#refuse,
    });
    this.#alike = checkRow({
      label: "Both sides alike",
      title: "Change left and right together",
      change: (on) => send({ type: "body_sizes", action: "couple", on }),
    });
    this.#keyframes = choiceRow({
      label: "Keyframes",
      title:
        "Refit: fit each keyframe to its joints and pins in the new body, as one entry of the history. " +
        "Keep: leave all stored poses in the body that they were made with",
      options: [
        ["refit", "Refit"],
        ["keep", "Keep as they are"],
      ],
      change: () => {},
    });
    this.#apply = textButton("Apply", "Make these the sizes of the body; undo restores the present ones", () =>
      this.#edit({ action: "apply", refit: this.#keyframes.select.value === "refit" }), { className: "is-primary" }
    );
    this.#discard = textButton("Discard", "Return to the present sizes", () => this.#edit({ action: "discard" }));
    this.#former = textButton("Previous", "Enter the sizes before the present ones; Apply sets them", () =>
      this.#edit({ action: "previous" }),
    );
    const buttons = make("div", "section-buttons", this.#apply, this.#discard, this.#former);
    const foot = make("div", "section-foot", this.#keyframes.element, this.#note, buttons);
    this.body.append(this.#person, this.#model.element, this.#height.element, this.#alike.element, this.#acquisition.element, this.#table, foot);
    store.on(["bodySizes", "state", "session"], () => this.#show());
    store.on(["acquisition", "bodySizes", "session"], () => this.#acquisition.update(store.facts.bodySizes?.person ?? 0));
  }

  /** @param {Record<string, unknown> & {action: string}} change */
  #edit(change) {
    const person = this.#store.facts.bodySizes?.person ?? 0;
    this.#send(/** @type {import("../model/protocol.js").ClientMessage} */ ({ type: "body_sizes", person, ...change }));
  }

  #show() {
    const { bodySizes: sizes, state, session } = this.#store.facts;
    const person = session?.people[sizes?.person ?? 0];
    if (!sizes || !state || !person) return;
    this.#person.textContent = person.name;
    this.#person.style.setProperty("--person", person.color);
    // A body of the session's own is listed, too.
    const names = sizes.bodies.includes(sizes.body) ? sizes.bodies : [sizes.body, ...sizes.bodies];
    const listed = [...this.#model.select.options].map(({ value }) => value);
    if (listed.join() !== names.join()) this.#model.fill(names.map((name) => [name, name]));
    this.#model.show(sizes.body);
    this.#height.limits(100 * sizes.height_limits_m[0], 100 * sizes.height_limits_m[1]);
    this.#height.show(tenths(100 * sizes.height_m));
    this.#alike.show(sizes.sides_alike);
    const shape = JSON.stringify([sizes.person, sizes.sides_alike, sizes.parts.map(({ name }) => name)]);
    if (shape !== this.#built) this.#build(sizes);
    this.#built = shape;
    const [low, high] = sizes.size_limits_m;
    for (const { field, read, factor } of this.#fields) {
      field.limits(low * factor, high * factor);
      field.show(tenths((read(sizes) ?? 0) * factor));
    }
    this.#discard.disabled = this.#apply.disabled = !sizes.edited;
    this.#apply.disabled = !sizes.edited && !state.other_sizes;
    this.#former.disabled = !sizes.has_former;
    this.#note.textContent = note(sizes, state.other_sizes);
    this.#note.hidden = !this.#note.textContent;
  }

  /** @param {BodySizes} sizes */
  #build(sizes) {
    this.#fields = [];
    const rows = this.#rows(sizes).map(([part, label]) => this.#row(part, label));
    const widths = sizes.widths.map(({ name }) => this.#width(name));
    const heads = [cell("", "")].concat(SIZES.map(({ head, title }) => cell(`${head}`, `${head}: ${title}`)));
    this.#table.replaceChildren(...heads, ...rows.flat(), ...widths.flat());
  }

  /**
   * Parts to list, with their labels: where both sides are alike, one part stands for its pair.
   *
   * @param {BodySizes} sizes
   * @returns {[string, string][]}
   */
  #rows({ parts, sides_alike }) {
    const names = parts.map(({ name }) => name);
    const isPaired = (/** @type {string} */ name) =>
      sides_alike && names.includes(name.replace(/^left_/, "right_")) && names.includes(name.replace(/^right_/, "left_"));
    const listed = names.filter((name) => !(name.startsWith("right_") && isPaired(name)));
    return listed.map((name) => [name, displayName(isPaired(name) ? name.replace(/^left_/, "") : name)]);
  }

  /**
   * @param {string} part
   * @param {string} label
   */
  #row(part, label) {
    const find = (/** @type {BodySizes} */ sizes) => sizes.parts.find(({ name }) => name === part);
    const fields = SIZES.map(({ name, title, factor }) => {
      const change = (/** @type {number} */ cm) => this.#edit({ action: "part", part, [name]: cm / factor });
      return this.#field(`${capital(label)}: ${title}`, (sizes) => find(sizes)?.[name], factor, change);
    });
    return [cell(capital(label), `Sizes of the ${label}`), ...fields];
  }

  /** @param {string} girdle */
  #width(girdle) {
    const title = `Distance between the two ${girdle} joints, cm`;
    const change = (/** @type {number} */ cm) => this.#edit({ action: "width", girdle, width_m: cm / 100 });
    const read = (/** @type {BodySizes} */ sizes) => sizes.widths.find(({ name }) => name === girdle)?.width_m;
    return [cell(capital(`${girdle}s`), title), cell("", ""), cell("", ""), this.#field(title, read, 100, change)];
  }

  /**
   * @param {string} title
   * @param {(sizes: BodySizes) => number | undefined} read
   * @param {number} factor
   * @param {(cm: number) => void} change
   */
  #field(title, read, factor, change) {
    const field = boundedField({
      name: title,
      low: 0,
      high: 300,
      step: STEP_CM,
      digits: 1,
      change: (value) => value !== null && change(value),
      refuse: this.#refuse,
    });
    field.element.title = title;
    this.#fields.push({ field, read, factor });
    return field.element;
  }
}

/**
 * @param {BodySizes} sizes
 * @param {boolean} hasOtherSizes whether the pose of the frame belongs to another body
 */
function note({ edited, outcome }, hasOtherSizes) {
  if (edited) return "Not applied yet: the second outline in the views shows these sizes.";
  return outcome || (hasOtherSizes ? "The pose of this frame belongs to other sizes and is shown with them." : "");
}

/** @param {number} cm */
function tenths(cm) {
  return Math.round(10 * cm) / 10;
}

/**
 * @param {string} text
 * @param {string} title
 */
function cell(text, title) {
  return make("span", { title, className: "size-label is-clipped" }, text);
}
