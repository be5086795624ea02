/** Settings of the tracker. */

import { make, textButton } from "../widgets/elements.js";
import { checkRow, choiceRow, numberRow } from "./rows.js";

/** @typedef {import("../model/protocol.js").TrackChanges} TrackChanges */
/** @typedef {import("../model/protocol.js").OptionInfo} OptionInfo */
/** @typedef {import("../model/protocol.js").MethodInfo} MethodInfo */
/** @typedef {boolean | number | string | null} OptionValue */
/** @typedef {{ element: HTMLElement, show: (value: OptionValue, isChanged: boolean) => void }} OptionRow */

/**
 * @param {import("../model/index.js").Context} context
 * @returns {import("./inspector.js").Section}
 */
export function trackSection({ store, send, say: refuse }) {
  const set = (/** @type {TrackChanges} */ changes) => send({ type: "track_settings", changes });
  const choices = make("div");
  const options = make("div");
  /** @type {ReturnType<typeof choiceRow> | null} */
  let method = null;
  let shown = "";
  /** @type {Map<string, OptionRow>} */
  const rows = new Map();
  const stride = numberRow("Stride", "Track every Nth frame alone. The frames between get no pose, and can be interpolated", {
    low: 1,
    high: 100,
    step: 1,
    change: (value) => set({ stride: Math.round(value ?? 1) }),
    refuse,
  });
  const cameras = cameraChoices((names) => set({ cameras: names }), refuse);
  const reset = textButton("Reset", "Restore the default track settings", () => {
    const { settings } = store.facts;
    if (!settings) return;
    const { method: name, stride: every, cameras: all } = settings.track_default;
    set({ method: name, stride: every, cameras: all, options: Object.fromEntries([...rows.keys()].map((key) => [key, null])) });
  });
  const body = make("div", {}, choices, stride.element, cameras.element, options, reset);

  /** @param {MethodInfo[]} methods */
  const build = (methods) => {
    const title = methods.map((each) => `${each.label}: ${each.help.charAt(0).toLowerCase()}${each.help.slice(1)}`).join(". ");
    const names = Object.fromEntries(methods.map((each) => [each.name, each.label]));
    method = choiceRow("Method", title, names, (value) => set({ method: value }));
    choices.replaceChildren(method.element);
    for (const option of methods.flatMap((each) => each.options)) {
      if (!rows.has(option.name)) rows.set(option.name, optionRow(option, (value) => set({ options: { [option.name]: value } }), refuse));
    }
  };

  const show = () => {
    const { settings } = store.facts;
    if (!settings) return;
    const { track, track_default: initial, methods } = settings;
    if (!method) build(methods);
    method?.show(track.method, track.method !== initial.method);
    stride.show(track.stride, track.stride !== initial.stride);
    cameras.show(store.facts.session?.cameras.map((camera) => camera.name) ?? [], track.cameras);
    const own = methods.find((each) => each.name === track.method)?.options ?? [];
    if (shown !== track.method) {
      shown = track.method;
      options.replaceChildren(...own.map((option) => rows.get(option.name)?.element ?? ""));
    }
    for (const option of own) {
      rows.get(option.name)?.show(track.options[option.name] ?? option.default, option.name in track.options);
    }
    reset.disabled = JSON.stringify(track) === JSON.stringify(initial);
  };
  store.on(["settings", "session"], show);
  return { id: "track", title: "Track settings", hint: "How the tracker finds the pose of each frame", body };
}

/**
 * The control of an option of a method.
 *
 * @param {OptionInfo} option
 * @param {(value: OptionValue) => void} change
 * @param {(text: string) => void} refuse
 * @returns {OptionRow}
 */
function optionRow({ label, help, kind, choices, limits, step }, change, refuse) {
  if (kind === "switch") {
    const row = checkRow(label, help, change);
    return { element: row.element, show: (value, isChanged) => row.show(value === true, isChanged) };
  }
  if (kind === "choice") {
    const row = choiceRow(label, help, choices, change);
    return { element: row.element, show: (value, isChanged) => row.show(String(value), isChanged) };
  }
  const [low, high] = limits ?? [0, Infinity];
  const whole = (/** @type {number | null} */ value) => (kind === "whole" && value !== null ? Math.round(value) : value);
  const row = numberRow(label, `${help}, ${low} to ${high}`, { low, high, step, change: (value) => change(whole(value)), refuse });
  return { element: row.element, show: (value, isChanged) => row.show(typeof value === "number" ? value : null, isChanged) };
}

/**
 * A box for each camera: the cameras to track with.
 *
 * @param {(names: string[]) => void} change receives the checked cameras; none for all
 * @param {(text: string) => void} refuse
 */
function cameraChoices(change, refuse) {
  const element = make("div", { title: "Cameras to track with. The others are still shown", role: "group", "aria-label": "Cameras to track with" });
  const head = make("span", "row-label is-clipped", "Cameras");
  const list = make("div", "camera-choices");
  element.append(head, list);
  const boxes = () => [...list.querySelectorAll("input")];
  let built = "";
  list.addEventListener("change", (event) => {
    const chosen = boxes().filter((box) => box.checked);
    if (chosen.length === 0 && event.target instanceof HTMLInputElement) {
      event.target.checked = true;
      refuse("Cameras: expected at least one to track with. Check another one first.");
      return;
    }
    change(chosen.length === boxes().length ? [] : chosen.map((box) => box.value));
  });
  return {
    element,
    /**
     * @param {string[]} names of all cameras
     * @param {string[]} chosen none for all
     */
    show(names, chosen) {
      if (built !== names.join("\n")) {
        built = names.join("\n");
        list.replaceChildren(...names.map(cameraBox));
      }
      for (const box of boxes()) box.checked = chosen.length === 0 || chosen.includes(box.value);
      head.classList.toggle("is-changed", chosen.length > 0);
    },
  };
}

/** @param {string} name */
function cameraBox(name) {
  return make("label", {}, make("input", { type: "checkbox", value: name }), name);
}
