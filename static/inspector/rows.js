/** Rows of the inspector: a label, a control and a unit. Each shows the program's value unless the user is typing. */

import { make } from "../widgets/elements.js";
import { slider } from "../widgets/popovers.js";
import { numberField } from "../widgets/number_field.js";

/** Shortest interval of messages while a slider is moved, ms. */
const SEND_MS = 80;

/**
 * @typedef {{element: HTMLElement, show: (value: number | null, isChanged?: boolean) => void, limits: (low: number, high: number) => void}} NumberRow
 * @typedef {(text: string) => void} Refuse shows why a value is refused
 */

/**
 * @param {string} label
 * @param {string} title
 * @param {{unit?: string, low: number, high: number, step: number, auto?: string, change: (value: number | null) => void,
 *   refuse: Refuse}} options auto: shown for no value, which is allowed then
 * @returns {NumberRow}
 */
export function numberRow(label, title, { unit = "", auto, ...options }) {
  const field = boundedField({ name: `${label}${unit && `, ${unit}`}`, allowsNone: auto !== undefined, ...options });
  if (auto !== undefined) field.element.placeholder = auto;
  const { element, mark } = row(label, title, field.element, make("span", "row-unit", unit));
  return {
    element,
    limits: field.limits,
    show(value, isChanged) {
      field.show(value);
      mark(isChanged);
    },
  };
}

/**
 * Make a number field that refuses values outside its limits and steps with the arrow keys. Without `digits` it shows as
 * few as it can.
 *
 * @param {{name: string, low: number, high: number, step: number | (() => number), digits?: number, allowsNone?: boolean,
 *   change: (value: number | null) => void, refuse: Refuse}} options
 */
export function boundedField({ name, low, high, step, digits, allowsNone = false, change, refuse }) {
  let shown = NaN;
  const within = (/** @type {number} */ value) => value >= low - 1e-9 && value <= high + 1e-9;
  const field = numberField({
    name,
    take(text) {
      if (text === "" && allowsNone) {
        change(null);
        return null;
      }
      const value = Number(text);
      if (text === "" || !within(value)) return `${name}: expected a number from ${tidy(low)} to ${tidy(high)}, found “${text}”.`;
      change(value);
      return null;
    },
    refuse,
    step: (factor) => {
      const by = typeof step === "function" ? step() : step;
      const to = Math.min(high, Math.max(low, (Number.isFinite(shown) ? shown : low) + factor * by));
      if (to !== shown) change(to);
    },
  });
  return {
    element: field.element,
    /** @param {number | null} value */
    show(value) {
      shown = value ?? NaN;
      field.show(value === null ? "" : digits === undefined ? tidy(value) : value.toFixed(digits));
    },
    /**
     * @param {number} least
     * @param {number} largest
     */
    limits(least, largest) {
      [low, high] = [least, largest];
    },
  };
}

/**
 * @param {string} label
 * @param {string} title
 * @param {(text: string) => string | null} take applies the text, or returns why it is invalid
 * @param {Refuse} refuse
 */
export function textRow(label, title, take, refuse) {
  const field = numberField({ name: label, take, refuse, step: null });
  field.element.classList.add("is-wide");
  const { element, mark } = row(label, title, field.element);
  return {
    element,
    /**
     * @param {string} text
     * @param {boolean} isChanged
     */
    show(text, isChanged) {
      field.show(text);
      mark(isChanged);
    },
  };
}

/**
 * @param {string} label
 * @param {string} title
 * @param {(on: boolean) => void} change
 */
export function checkRow(label, title, change) {
  const input = make("input", { type: "checkbox", onchange: () => change(input.checked) });
  const { element, mark } = row(label, title, input);
  return {
    element,
    /**
     * @param {boolean} on
     * @param {boolean} [isChanged]
     */
    show(on, isChanged) {
      input.checked = on;
      mark(isChanged);
    },
  };
}

/** Options of a choice that is filled later. @type {Record<string, string>} */
export const NO_OPTIONS = {};

/**
 * @template {string} T
 * @param {string} label
 * @param {string} title
 * @param {Record<T, string>} options labels of the values
 * @param {(value: T) => void} change
 */
export function choiceRow(label, title, options, change) {
  const select = make("select", { onchange: () => change(/** @type {T} */ (select.value)) });
  const { element, mark } = row(label, title, select);
  let listed = "";
  const fill = (/** @type {string[][]} */ choices) => {
    const described = JSON.stringify(choices);
    if (described === listed) return; // an open list of choices must not be replaced
    listed = described;
    select.replaceChildren(...choices.map(([value, text]) => new Option(text, value)));
  };
  fill(Object.entries(options));
  return {
    element,
    select,
    fill,
    /**
     * @param {T} value
     * @param {boolean} [isChanged]
     */
    show(value, isChanged) {
      select.value = value;
      mark(isChanged);
    },
  };
}

/**
 * @param {string} label
 * @param {string} title
 * @param {{min: number, max: number, step: number, format: (value: number) => string, change: (value: number) => void}} options
 */
export function sliderRow(label, title, { change, ...options }) {
  const send = throttled(change);
  const made = slider({ label, title, ...options, onInput: send });
  const { element } = row(label, title, made.input, made.value);
  return {
    element,
    input: made.input,
    /** @param {number} value */
    show(value) {
      if (!send.isBusy()) made.show(value);
    },
  };
}

/**
 * Text with few digits: no trailing zeros, no rounding errors of converted units.
 *
 * @param {number} value
 */
export function tidy(value) {
  return String(Number(value.toFixed(2)));
}

/**
 * @param {string} label
 * @param {string} title
 * @param {HTMLElement[]} controls
 */
function row(label, title, ...controls) {
  const head = make("span", "row-label is-clipped", label);
  const element = make("label", { className: "row", title }, head, ...controls);
  return { element, mark: (isChanged = false) => void head.classList.toggle("is-changed", isChanged) };
}

/**
 * Pass on the newest value at most every `SEND_MS`.
 *
 * @param {(value: number) => void} change
 */
function throttled(change) {
  let sentAt = -Infinity;
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let timer;
  const send = (/** @type {number} */ value) => {
    clearTimeout(timer);
    const wait = sentAt + SEND_MS - performance.now();
    const now = () => {
      sentAt = performance.now();
      change(value);
    };
    if (wait > 0) timer = setTimeout(now, wait);
    else now();
  };
  /** Whether the user moved it so lately that an older value of the program would make it jump. */
  send.isBusy = () => performance.now() < sentAt + 5 * SEND_MS;
  return send;
}

/** A paragraph of a section. */
export function sectionNote(text = "") {
  return make("p", "section-note", text);
}
