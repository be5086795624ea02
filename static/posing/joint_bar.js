/** Bar below the views: selected joint, degrees of freedom as numbers, locks, step sizes and edits of the whole pose. */

import { mountCopyMenu } from "./copy_menu.js";
import { meaning, shortName } from "./dof_names.js";
import { button, byId, icon, make, onChange, textButton } from "../widgets/elements.js";
import { numberField } from "../widgets/number_field.js";
import { makeScrubber } from "../widgets/scrubber.js";
import { displayName } from "../widgets/text.js";

const LOCK = "M4 7.5h8v5.5H4zM5.5 7.5V5.2a2.5 2.5 0 0 1 5 0v2.3";
const UNLOCKED = "M4 7.5h8v5.5H4zM5.5 7.5V4.2a2.5 2.5 0 0 1 4.7-1.2";
const UNITS = { deg: "°", cm: "cm" };
/** Change of a value per CSS pixel when its name is dragged sideways. */
const PER_PIXEL = { deg: 0.5, cm: 0.2 };
/** @typedef {{dof: number, row: HTMLElement, entry: import("../widgets/number_field.js").NumberField, lock: HTMLButtonElement}} Field */

/** @typedef {ReturnType<typeof mountJointBar>} JointBar */

/**
 * @param {HTMLElement} element
 * @param {import("../model/store.js").Store} store
 * @param {import("./posing.js").Posing} posing
 * @param {(text: string) => void} say
 */
export function mountJointBar(element, store, posing, say) {
  const joint = byId("joint-name", HTMLSelectElement);
  const list = byId("joint-dofs", HTMLElement);
  const lock = byId("lock-joint", HTMLButtonElement);
  const reset = byId("reset-limb", HTMLButtonElement);
  /** @type {Field[]} */
  let fields = [];
  let builtFor = "";
  button("previous-joint", () => posing.toJoint(-1));
  button("next-joint", () => posing.toJoint(1));
  button("lock-joint", () => posing.toggleLock(posing.joint().dofs));
  button("mirror-pose", () => posing.mirror());
  button("reset-limb", () => posing.resetLimb());
  onChange(joint, () => posing.selectPoint(joint.value));
  mountCopyMenu(store, posing);
  addStep("step-cm", "cm", "Step of the arrow keys in centimetres (Shift: ×10, Ctrl: ×0.1)");
  addStep("step-deg", "deg", "Step of + and - in degrees");
  // The wheel scrolls a long row of fields sideways.
  list.addEventListener("wheel", (event) => {
    list.scrollLeft += event.deltaY + event.deltaX;
  });
  store.on(["connected"], () => enable(element));
  store.on(["state", "session", "dof"], () => show());
  new ResizeObserver(() => fitNames()).observe(list);
  enable(element);

  /** Focus the number field of the selected degree of freedom. */
  function type() {
    const selected = fields.find(({ dof }) => dof === store.facts.dof);
    selected?.row.scrollIntoView({ block: "nearest", inline: "nearest" });
    selected?.entry.element.focus();
  }

  /** @param {HTMLElement} element */
  function enable(element) {
    element.inert = !store.facts.connected;
  }

  /**
   * @param {string} id of the element to replace
   * @param {"cm" | "deg"} unit
   * @param {string} name
   */
  function addStep(id, unit, name) {
    const entry = numberField({
      name,
      take: (text) => {
        const step = Number(text);
        if (text === "" || !(step > 0 && step <= 100)) return `Step: expected a number above 0 and up to 100, found “${text}”.`;
        posing.setSteps({ [unit]: step });
        return null;
      },
      refuse: say,
      step: null,
    });
    entry.element.title = name;
    entry.show(String(posing.steps[unit]));
    byId(id, HTMLElement).replaceWith(entry.element);
    entry.element.id = id;
  }

  function show() {
    const { person, point, dofs, limb } = posing.joint();
    const { state, dof: selected } = store.facts;
    if (!person || !state || !point) return;
    const built = JSON.stringify([state.person, person.points, dofs]);
    if (built !== builtFor) {
      builtFor = built;
      joint.replaceChildren(...person.points.map((name) => new Option(displayName(name), name)));
      fields = dofs.map((dof) => field(person.dofs[dof], dof, point));
      list.replaceChildren(...fields.map(({ row }) => row));
      fitNames();
    }
    joint.value = point;
    joint.classList.toggle("is-nothing", state.point === null);
    for (const field of fields) fill(field, person.dofs[field.dof], state, field.dof === selected);
    showLock(lock, posing.isLocked(dofs), displayName(point), " (O)");
    lock.disabled = dofs.length === 0;
    reset.title = `Reset ${limb.name} to the neutral pose`;
    reset.setAttribute("aria-label", `Reset ${limb.name}`);
  }

  /** Use whole names where the row has room for them, else short ones. */
  function fitNames() {
    list.classList.remove("is-short");
    list.classList.toggle("is-short", list.scrollWidth > list.clientWidth);
  }

  /**
   * @param {import("../model/protocol.js").DofInfo} info
   * @param {number} dof
   * @param {string} point
   * @returns {Field}
   */
  function field(info, dof, point) {
    const name = info.joint === point ? info.name : `${displayName(info.joint)} ${info.name}`;
    const hint = "Drag the name sideways to change it (Shift: fine steps).";
    const effect = meaning(info);
    const title = `${displayName(info.joint)} ${info.name}${effect && `: ${effect}`}, ${range(info)}. ${hint}`;
    const label = make("span", "dof-name is-clipped", make("span", "is-whole", name), make("span", "is-brief", shortName(info.name)));
    makeScrubber(label, {
      begin: () => (posing.isLocked([dof]) ? null : (store.facts.state?.dofs[dof] ?? null)),
      perPixel: PER_PIXEL[info.unit],
      change: (value) => posing.slide(dof, within(value, info)),
    });
    const entry = numberField({
      name: `${displayName(info.joint)} ${info.name}, ${UNITS[info.unit]}`,
      take: (text) => take(info, dof, text),
      refuse: say,
      step: (factor) => posing.turn(factor),
    });
    entry.element.addEventListener("focus", () => posing.selectDof(dof));
    const unit = make("span", "dof-unit", UNITS[info.unit]);
    const lock = textButton("", "", () => posing.toggleLock([dof]), { className: "is-lock" });
    const row = make("div", { className: "dof", title }, label, entry.element, unit, lock);
    row.addEventListener("pointerdown", () => posing.selectDof(dof));
    return { dof, row, entry, lock };
  }

  /**
   * @param {import("../model/protocol.js").DofInfo} info
   * @param {number} dof
   * @param {string} text
   */
  function take(info, dof, text) {
    const value = Number(text);
    const isWithin = (info.low === null || value >= info.low - 0.05) && (info.high === null || value <= info.high + 0.05);
    if (text === "" || !Number.isFinite(value) || !isWithin || Math.abs(value) > 1e5) {
      return `${displayName(info.joint)} ${info.name}: expected a number ${range(info)}, found “${text}”.`;
    }
    posing.set(dof, value);
    return null;
  }

  /**
   * @param {Field} field
   * @param {import("../model/protocol.js").DofInfo} info
   * @param {import("../model/protocol.js").StateMessage} state
   * @param {boolean} isSelected
   */
  function fill({ dof, row, entry, lock }, info, state, isSelected) {
    const value = state.dofs[dof] ?? 0;
    const isLocked = state.locked.includes(dof);
    entry.show((Math.abs(value) < 0.05 ? 0 : value).toFixed(1));
    entry.element.disabled = isLocked;
    row.classList.toggle("is-selected", isSelected);
    row.classList.toggle("is-locked", isLocked);
    row.classList.toggle("is-bounded", info.low !== null && info.high !== null);
    if (info.low !== null && info.high !== null) {
      row.style.setProperty("--at", String((value - info.low) / Math.max(1e-9, info.high - info.low)));
    }
    showLock(lock, isLocked, `${displayName(info.joint)} ${info.name}`);
  }

  return { type };
}

/**
 * @param {number} value
 * @param {import("../model/protocol.js").DofInfo} info
 */
function within(value, { low, high }) {
  return Math.max(low ?? -Infinity, Math.min(high ?? Infinity, value));
}

/** @param {import("../model/protocol.js").DofInfo} info */
function range({ low, high, unit }) {
  const number = (/** @type {number} */ limit) => `${Math.round(10 * limit) / 10}`;
  if (low !== null && high !== null) return `from ${number(low)} to ${number(high)} ${UNITS[unit]}`;
  return `in ${unit === "cm" ? "centimetres" : "degrees"}, without limits`;
}

/**
 * @param {HTMLButtonElement} lock
 * @param {boolean} isLocked
 * @param {string} what
 * @param {string} [key] that locks it
 */
function showLock(lock, isLocked, what, key = "") {
  lock.setAttribute("aria-pressed", String(isLocked));
  const title = `${isLocked ? "Unlock" : "Lock"} ${what}`;
  if (lock.ariaLabel === title) return;
  lock.title = title + key;
  lock.setAttribute("aria-label", title);
  lock.replaceChildren(icon(isLocked ? LOCK : UNLOCKED));
}
