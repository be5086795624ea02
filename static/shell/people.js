/** People of the session: active person, visibility, solo, and the people that searches move. */

import { button, byId, iconButton, make, onChange } from "../widgets/elements.js";
import { opensPopover, togglePopover } from "../widgets/popovers.js";

const EYE = "M1.5 8S4 3.5 8 3.5 14.5 8 14.5 8 12 12.5 8 12.5 1.5 8 1.5 8zM8 6a2 2 0 1 0 .01 0z";
const SHUT = "M1.5 7.5S4 11.5 8 11.5s6.5-4 6.5-4M3.5 10.3 2.3 12M8 11.5v2M12.5 10.3l1.2 1.7";
const COPY = "M5.5 5.5h8v8h-8zM3.5 10.5h-1v-8h8v1";

/** @typedef {{row: HTMLElement, radio: HTMLInputElement, eye: HTMLButtonElement, copy: HTMLButtonElement, summary: HTMLElement}} Row */

/** @typedef {ReturnType<typeof mountPeople>} People */

/**
 * @param {import("../model/store.js").Store} store
 * @param {import("../model/actions.js").Actions} actions
 * @param {import("../posing/posing.js").Posing} posing
 */
export function mountPeople(store, actions, posing) {
  const bar = byId("people", HTMLElement);
  const list = byId("people-list", HTMLElement);
  const panel = byId("people-panel", HTMLElement);
  const open = byId("show-people", HTMLButtonElement);
  const scopeChoice = byId("search-scope", HTMLSelectElement);
  /** @type {HTMLInputElement[]} */
  let chips = [];
  /** @type {Row[]} */
  let rows = [];
  const solo = button("solo", () => actions.toggleSolo());
  opensPopover(panel, open, () => toggle());
  onChange(scopeChoice, () => store.set({ scope: scopeChoice.value === "one" ? "one" : "all" }));
  store.on(["session"], () => build());
  store.on(["session", "state", "connected", "scope"], () => show());

  function toggle() {
    if ((store.facts.session?.people.length ?? 0) > 1) togglePopover(panel, open);
  }

  function build() {
    const everybody = store.facts.session?.people ?? [];
    const people = everybody.length > 1 ? everybody : [];
    byId("people-group", HTMLElement).hidden = scopeChoice.hidden = people.length === 0;
    chips = people.map((info, person) => choice(bar, "person", info, person));
    bar.replaceChildren(...chips.map((chip) => /** @type {HTMLElement} */ (chip.parentElement)));
    rows = people.map((info, person) => row(info, person));
    list.replaceChildren(...rows.map(({ row }) => row));
  }

  /**
   * Make a switch for a person, in the person's colour.
   *
   * @param {HTMLElement} within
   * @param {string} name of the radio group
   * @param {import("../model/protocol.js").PersonInfo} info
   * @param {number} person
   */
  function choice(within, name, info, person) {
    const input = make("input", { type: "radio", name, value: String(person) });
    input.addEventListener("change", () => {
      actions.selectPerson(person);
      if (within === bar) input.blur();
    });
    make("label", { title: `Select ${info.name}` }, input, make("span", { className: "person-name is-clipped", "--person": info.color }, info.name));
    return input;
  }

  /**
   * @param {import("../model/protocol.js").PersonInfo} info
   * @param {number} person
   * @returns {Row}
   */
  function row(info, person) {
    const row = make("li");
    const radio = choice(row, "person-in-list", info, person);
    const model = make("span", "quiet", `${info.model}, ${info.height_m.toFixed(2)} m`);
    const summary = make("span", "quiet");
    const bend = `Copy the joint angles of ${info.name}; position and orientation stay`;
    const copy = iconButton(COPY, bend, () => posing.copyPerson(person));
    copy.setAttribute("aria-label", `Copy the pose of ${info.name}`);
    const eye = iconButton(EYE, `Show ${info.name}`, () =>
      actions.showPerson(person, !store.facts.state?.people[person]?.shown),
    );
    row.append(/** @type {HTMLElement} */ (radio.parentElement), model, summary, copy, eye);
    return { row, radio, eye, copy, summary };
  }

  function show() {
    const { state, session, connected, scope } = store.facts;
    if (!state || !session || session.people.length < 2) return;
    const name = session.people[state.person].name;
    chips.forEach((chip, person) => {
      chip.checked = person === state.person;
      chip.disabled = !connected;
      chip.parentElement?.classList.toggle("is-unseen", !state.people[person]?.shown);
    });
    rows.forEach(({ radio, eye, copy, summary }, person) => {
      const { shown, source, status } = state.people[person];
      radio.checked = person === state.person;
      radio.disabled = eye.disabled = !connected;
      copy.disabled = !connected || person === state.person;
      summary.textContent = source === null ? "not placed" : [source, status].filter(Boolean).join(", ");
      eye.setAttribute("aria-pressed", String(shown));
      eye.title = `${shown ? "Hide" : "Show"} ${session.people[person].name} in all views`;
      eye.querySelector("path")?.setAttribute("d", shown ? EYE : SHUT);
    });
    solo.disabled = !connected;
    solo.setAttribute("aria-pressed", String(state.solo));
    scopeChoice.disabled = !connected;
    const only = scopeChoice.options[1];
    if (only.textContent !== `Only ${name}`) only.textContent = `Only ${name}`;
    scopeChoice.value = scope;
  }

  return { toggle };
}
