/** Body sizes of the active person: first a draft that the views outline, then the body, as an entry of the history. */

import { make, textButton } from "../widgets/elements.js";
import { capital, displayName } from "../widgets/text.js";
import { acquisitionView } from "./acquisition_view.js";
import { NO_OPTIONS, boundedField, checkRow, choiceRow, numberRow } from "./rows.js";

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

/** @param {import("../model/index.js").Context} context */
export function bodySection(context) {
  const body = make("div");
  const personName = make("p", "person-name is-clipped");
  const table = make("div", "size-table");
  const outcomeText = make("p", { className: "section-note", role: "status" });
  /** @type {{field: Field, read: (sizes: BodySizes) => number | undefined, factor: number}[]} */
  let fields = [];
  let built = "";
  const { store, send, say } = context;
  const acquisition = acquisitionView(context);
  const kinds =
    "Joints and parts of the person, such as feet. Sizes that both bodies have stay, and keyframes are fitted. " +
    "Tracked poses keep the former body until tracked again. Can be undone";
  const model = choiceRow("Body", kinds, NO_OPTIONS, (to) => edit({ action: "body", to }));
  const height = numberRow("Height", "Body height; all other sizes scale with it", {
    unit: "cm",
    low: 30,
    high: 300,
    step: 1,
    change: (value) => value !== null && edit({ action: "height", height_m: value / 100 }),
    refuse: say,
  });
  const alike = checkRow("Both sides alike", "Change left and right together", (on) => send({ type: "body_sizes", action: "couple", on }));
  const fates =
    "Refit: fit each keyframe to its joints and pins in the new body, as one entry of the history. " +
    "Keep: leave all stored poses in the body that they were made with";
  const keyframes = choiceRow("Keyframes", fates, { refit: "Refit", keep: "Keep as they are" }, () => {});
  const apply = textButton("Apply", "Make these the sizes of the body; undo restores the present ones", () =>
    edit({ action: "apply", refit: keyframes.select.value === "refit" }), { className: "is-primary" }
  );
  const discard = textButton("Discard", "Return to the present sizes", () => edit({ action: "discard" }));
  const former = textButton("Previous", "Enter the sizes before the present ones; Apply sets them", () =>
    edit({ action: "previous" }),
  );
  const buttons = make("div", "section-buttons", apply, discard, former);
  const foot = make("div", "section-foot", keyframes.element, outcomeText, buttons);
  body.append(personName, model.element, height.element, alike.element, acquisition.element, table, foot);
  store.on(["bodySizes", "state", "session"], () => show());
  store.on(["acquisition", "bodySizes", "session"], () => acquisition.update(store.facts.bodySizes?.person ?? 0));

  /** @param {Record<string, unknown> & {action: string}} change */
  function edit(change) {
    const person = store.facts.bodySizes?.person ?? 0;
    send(/** @type {import("../model/protocol.js").ClientMessage} */ ({ type: "body_sizes", person, ...change }));
  }

  function show() {
    const { bodySizes: sizes, state, session } = store.facts;
    const person = session?.people[sizes?.person ?? 0];
    if (!sizes || !state || !person) return;
    personName.textContent = person.name;
    personName.style.setProperty("--person", person.color);
    // A body of the session's own is listed, too.
    const names = sizes.bodies.includes(sizes.body) ? sizes.bodies : [sizes.body, ...sizes.bodies];
    model.fill(names.map((name) => [name, name]));
    model.show(sizes.body);
    height.limits(100 * sizes.height_limits_m[0], 100 * sizes.height_limits_m[1]);
    height.show(tenths(100 * sizes.height_m));
    alike.show(sizes.sides_alike);
    const shape = JSON.stringify([sizes.person, sizes.sides_alike, sizes.parts.map(({ name }) => name)]);
    if (shape !== built) build(sizes);
    built = shape;
    const [low, high] = sizes.size_limits_m;
    for (const { field, read, factor } of fields) {
      field.limits(low * factor, high * factor);
      field.show(tenths((read(sizes) ?? 0) * factor));
    }
    discard.disabled = apply.disabled = !sizes.edited;
    apply.disabled = !sizes.edited && !state.other_sizes;
    former.disabled = !sizes.has_former;
    outcomeText.textContent = note(sizes, state.other_sizes);
    outcomeText.hidden = !outcomeText.textContent;
  }

  /** @param {BodySizes} sizes */
  function build(sizes) {
    fields = [];
    const rows = partRows(sizes).map(([part, label]) => row(part, label));
    const widths = sizes.widths.map(({ name }) => width(name));
    const heads = [cell("", "")].concat(SIZES.map(({ head, title }) => cell(`${head}`, `${head}: ${title}`)));
    table.replaceChildren(...heads, ...rows.flat(), ...widths.flat());
  }

  /**
   * Parts to list, with their labels: where both sides are alike, one part stands for its pair.
   *
   * @param {BodySizes} sizes
   * @returns {[string, string][]}
   */
  function partRows({ parts, sides_alike }) {
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
  function row(part, label) {
    const find = (/** @type {BodySizes} */ sizes) => sizes.parts.find(({ name }) => name === part);
    const fields = SIZES.map(({ name, title, factor }) => {
      const change = (/** @type {number} */ cm) => edit({ action: "part", part, [name]: cm / factor });
      return field(`${capital(label)}: ${title}`, (sizes) => find(sizes)?.[name], factor, change);
    });
    return [cell(capital(label), `Sizes of the ${label}`), ...fields];
  }

  /** @param {string} girdle */
  function width(girdle) {
    const title = `Distance between the two ${girdle} joints, cm`;
    const change = (/** @type {number} */ cm) => edit({ action: "width", girdle, width_m: cm / 100 });
    const read = (/** @type {BodySizes} */ sizes) => sizes.widths.find(({ name }) => name === girdle)?.width_m;
    return [cell(capital(`${girdle}s`), title), cell("", ""), cell("", ""), field(title, read, 100, change)];
  }

  /**
   * @param {string} title
   * @param {(sizes: BodySizes) => number | undefined} read
   * @param {number} factor
   * @param {(cm: number) => void} change
   */
  function field(title, read, factor, change) {
    const field = boundedField({
      name: title,
      low: 0,
      high: 300,
      step: STEP_CM,
      digits: 1,
      change: (value) => value !== null && change(value),
      refuse: say,
    });
    field.element.title = title;
    fields.push({ field, read, factor });
    return field.element;
  }

  return { id: "body", title: "Body sizes", hint: "Lengths and girths of the active person; acquire them from the footage", body };
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
