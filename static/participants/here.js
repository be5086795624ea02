/** The people on the session: initials in the top bar, and a list with frames in a popover. */

import { byId, make } from "../widgets/elements.js";
import { opensPopover, togglePopover } from "../widgets/popovers.js";
import { capital } from "../widgets/text.js";
import { colorOf, initialsOf, nameOf } from "./marks.js";

const ROLES = { host: "host", annotate: "annotates", review: "reviews", look: "looks" };
/** Number of people whose initials are shown; the others are counted. */
const SHOWN = 4;

/**
 * @param {import("../model/index.js").Context} context
 * @param {ReturnType<typeof import("./join_form.js").joinForm>} join
 */
export function mountHere(context, join) {
  const button = byId("show-participants", HTMLButtonElement);
  const panel = byId("participants-panel", HTMLElement);
  const chipRow = byId("participant-chips", HTMLElement);
  const list = byId("participants-list", HTMLElement);
  panel.append(join.form);
  opensPopover(panel, button, () => toggle());
  panel.addEventListener("toggle", () => showButton());
  context.store.on(["presence"], () => show());

  function toggle() {
    button.hidden = false; // the list opens below it
    togglePopover(panel, button);
    if (panel.matches(":popover-open")) join.input.focus();
  }

  function show() {
    const people = context.store.facts.presence?.people ?? [];
    const others = people.filter(({ is_self }) => !is_self);
    const chips = others.slice(0, SHOWN).map((person) => chipOf(person, people.indexOf(person)));
    if (others.length > SHOWN) chips.push(make("span", {}, `+${others.length - SHOWN}`));
    chipRow.replaceChildren(...chips);
    showButton();
    const names = others.map((person) => `${nameOf(person)} on frame ${person.frame}`);
    button.title = names.length ? `Here: ${names.join(", ")}` : "Nobody else is here";
    button.setAttribute("aria-label", names.length ? `Who is here: ${names.length} others` : "Who is here: nobody else");
    list.replaceChildren(...people.map((person, index) => row(person, index)));
  }

  /** A host who is alone needs the button only while the list is open. */
  function showButton() {
    const { people, link } = context.store.facts.presence ?? { people: [], link: "host" };
    button.hidden = people.length < 2 && link === "host" && !panel.matches(":popover-open");
  }

  /**
   * @param {import("../model/protocol.js").PresentPerson} person
   * @param {number} index
   */
  function row(person, index) {
    const name = make("span", "participant-name is-clipped", nameOf(person) + (person.is_self ? " (you)" : ""));
    const role = make("span", "quiet", ROLES[person.role]);
    const at = make("button", { type: "button", title: `Go to frame ${person.frame}`, disabled: person.is_self }, `Frame ${person.frame}`); // prettier-ignore
    at.addEventListener("click", () => context.navigation.goTo(person.frame));
    return make("li", {}, chipOf(person, index), name, role, at, make("span", "participant-work", capital(person.doing)));
  }

  return { toggle };
}

/**
 * @param {import("../model/protocol.js").PresentPerson} person
 * @param {number} index
 */
function chipOf(person, index) {
  const className = `participant-chip${person.doing ? " is-at-work" : ""}`;
  return make("span", { className, "--participant": colorOf(index), "aria-hidden": "true" }, initialsOf(person));
}
