/** Commands of the palette: keys, buttons, layers, cameras, people, joints and frames. */

import { REVIEWED, STATUSES } from "../model/cells.js";
import { LAYERS } from "../model/layers.js";
import { alternativesOf, hasSearch, hasTrack } from "../model/selectors.js";
import { displayName } from "../widgets/text.js";

/**
 * @typedef {object} Command
 * @property {string} id the same in all sessions
 * @property {string} area
 * @property {string} label
 * @property {string[]} keys
 * @property {string} words additional search terms
 * @property {() => string | null} why why it is unavailable; null if it is available
 * @property {() => void} run
 *
 * @typedef {object} CommandContext
 * @property {import("../model/store.js").Store} store
 * @property {import("../model/navigation.js").Navigation} navigation
 * @property {import("../panes/pane_grid.js").PaneGrid} grid
 * @property {import("../posing/posing.js").Posing} posing
 * @property {import("../model/layers.js").Layers} layers
 * @property {import("../model/actions.js").Actions} actions
 * @property {import("../inspector/inspector.js").Inspector} inspector
 * @property {() => string | null} away why all commands are unavailable while disconnected
 */

/** Number of commands that are suggested: they are read at a glance. */
const MAX_SUITING = 6;

const BUTTONS =
  ".top-bar button, .top-bar input, #joint-bar button, .transport button, .transport input, #range-bar button, .drawer-bar label";

/**
 * Commands of keys. Bindings of several keys are left out, because other commands replace them.
 *
 * @param {import("../widgets/key_matching.js").Binding[]} table
 * @returns {Command[]}
 */
export function keyCommands(table) {
  return table
    .filter(({ keys, label }) => !keys.some((key) => key.includes("–")) && label !== "Commands")
    .map(({ keys, label, words, area, why, run }) => ({
      id: `key ${label}`,
      area: area ?? "More",
      label,
      keys,
      words: words ?? "",
      why: () => why?.() ?? null,
      run: () => run(new KeyboardEvent("keydown")),
    }));
}

/**
 * Buttons and switches without a binding.
 *
 * @param {import("../widgets/key_matching.js").Binding[]} table
 * @returns {Command[]}
 */
export function buttonCommands(table) {
  const known = new Set(table.map(({ label }) => label));
  const commands = [];
  for (const control of document.querySelectorAll(BUTTONS)) {
    if (!(control instanceof HTMLElement) || !isThere(control)) continue;
    const { label, title } = wordsOf(control);
    if (!label || known.has(label)) continue;
    const input = control.matches("input") ? control : (control.querySelector("input") ?? control);
    commands.push({
      id: `button ${control.id || label}`,
      area: control.closest("[role=group], fieldset, [role=toolbar]")?.getAttribute("aria-label") ?? "More",
      label,
      keys: [],
      words: title,
      why: () => {
        if (control.closest("#range-bar[hidden]")) return "No range is marked. Drag over the timeline with Shift to mark one.";
        return input.matches(":disabled") ? `Not available now: ${title}.` : null;
      },
      run: () => input.click(),
    });
  }
  return commands;
}

/**
 * Layers, cameras, people and joints, and the frame if the query is a number.
 *
 * @param {CommandContext} context
 * @param {string} query
 * @returns {Command[]}
 */
export function contextCommands({ store, navigation, grid, posing, layers, actions, away }, query) {
  const { session, state, filled } = store.facts;
  /** @type {Command[]} */
  const commands = [];
  const add = (/** @type {string} */ area, /** @type {string} */ label, /** @type {() => void} */ run, words = "", id = `${area} ${label}`) =>
    commands.push({ id, area, label, keys: [], words, why: away, run });
  const frame = /^(?:go to\s+)?(?:frame\s*)?(\d+)$/i.exec(query.trim());
  const last = (session?.n_frames ?? 1) - 1;
  if (frame) {
    const number = Number(frame[1]);
    add("Frame", `Go to frame ${number}`, () => navigation.goTo(number), query);
    if (number > last) commands[0].why = () => `The last frame is ${last}.`;
  }
  for (const { id, label, title } of LAYERS) {
    const isShown = store.facts.layers.shown[id];
    add("Layer", `${isShown ? "Hide" : "Show"} ${label.toLowerCase()}`, () => layers.toggle([id]), `layer show hide ${title}`, `layer ${id}`);
  }
  session?.cameras.forEach(({ name }, index) => {
    const label = filled === index ? "Show all cameras" : `Fill the grid with ${name}`;
    add("Camera", label, () => grid.toggleFill(index), `camera view ${index + 1} ${name}`, `camera ${name}`);
  });
  if ((session?.people.length ?? 0) > 1) {
    session?.people.forEach(({ name }, index) => {
      const isShown = state?.people[index]?.shown ?? true;
      add("Person", `Select ${name}`, () => actions.selectPerson(index), "person");
      add("Person", `${isShown ? "Hide" : "Show"} ${name}`, () => actions.showPerson(index, !isShown), "person show hide", `shown ${name}`);
      if (index !== state?.person) add("Person", `Copy the pose of ${name}`, () => posing.copyPerson(index), "person joint angles");
    });
  }
  alternativesOf(store.facts).forEach(({ limbs }, rank) => {
    const where = limbs.length ? limbs.join(", ") : "body";
    add("Posing", `Take alternative ${rank + 1}: ${where} elsewhere`, () => posing.takeAlternative(rank), "another pose ghost number", `alternative ${rank + 1}`);
  });
  const points = session?.people[state?.person ?? 0]?.points ?? [];
  for (const point of points) add("Joint", `Select ${displayName(point)}`, () => posing.selectPoint(point), "joint");
  return commands;
}

/**
 * The rows of the inspector, each of which opens there.
 *
 * @param {CommandContext} context
 * @returns {Command[]}
 */
export function settingCommands({ inspector, away }) {
  return inspector.commands().map(({ area, label, words, run }) => ({ id: `${area} ${label}`, area, label, keys: [], words, why: away, run }));
}

/**
 * Labels of the commands that suit the state, the most fitting first.
 *
 * @param {import("../model/store.js").Facts} facts
 * @returns {string[]}
 */
export function suitingLabels(facts) {
  const { state, range, finding, timeline } = facts;
  if (!state) return [];
  const isPlaced = state.people.some(({ source }) => source !== null) || timeline.size > 0;
  const hasDoubts = timeline.statuses.some((status, frame) => STATUSES[status] !== "" && STATUSES[status] !== "good" && !(timeline.marks[frame] & REVIEWED));
  /** @type {[boolean, string[]][]} */
  const cases = [
    [hasTrack(state), ["Pause or continue tracking", "Follow the tracker (toggle)"]],
    [hasSearch(state), ["Search: this frame", "Search: one step", "Search panel"]],
    [!isPlaced && !finding?.running, ["Find people", "New session from videos and a calibration"]],
    [range !== null, ["Interpolate the marked range", "Estimate the poses here again", "Track forward"]],
    [state.compared !== null, ["Show the pose before the last fit or search, or its result"]],
    [(state.people[state.person]?.alternatives ?? 0) > 0, ["Switch to the alternative pose, or back"]],
    [state.status === "doubtful" || state.status === "lost", ["Search: this frame", "Accept the doubtful or lost poses here: mark them as reviewed"]],
    [state.point !== null, ["Fit to pins and edges", "Pin the joint by clicks (toggle)"]],
    [hasDoubts, ["Next doubtful or lost pose by severity", "Doubtful and lost poses, most severe first"]],
    [isPlaced, ["Fit to pins and edges", "Track forward", "Zoom all views to the people"]],
  ];
  return [...new Set(cases.flatMap(([holds, labels]) => (holds ? labels : [])))].slice(0, MAX_SUITING);
}

/** @param {HTMLElement} control */
function wordsOf(control) {
  const title = control.title || control.closest("label")?.title || "";
  const text = control.getAttribute("aria-label") ?? (control.matches("input") ? control.closest("label") : control)?.textContent ?? "";
  return { label: (text.trim().length > 1 ? text : title).trim(), title };
}

/** @param {HTMLElement} control */
function isThere(control) {
  const hidden = control.closest("[hidden]");
  return (!hidden || hidden.id === "range-bar") && !control.closest("[data-no-command]");
}
