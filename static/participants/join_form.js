/** The field for the name by which a page joins. */

import { make, onSubmit } from "../widgets/elements.js";

const DOES = { host: "annotate", annotate: "annotate", review: "review", look: "look around" };

/**
 * @param {import("../model/index.js").Context} context
 * @param {string} place of the form in the page, which makes its field's id unique
 */
export function joinForm({ store, joinAs }, place) {
  const input = make("input", { type: "text", id: `join-name-${place}`, name: "name", maxLength: 60, required: true, autocomplete: "name", className: "query-field" }); // prettier-ignore
  const label = make("label", { htmlFor: input.id });
  const join = make("button", { type: "submit", title: "Work under this name, on a frame of your own (Enter)" }, "Join");
  const refusal = make("output", "join-refusal");
  const form = make("form", "join-form", label, input, join, refusal);
  onSubmit(form, () => {
    joinAs(input.value.trim());
    input.blur();
  });
  input.addEventListener("keydown", (event) => {
    event.stopPropagation();
    if (event.key === "Escape") input.blur();
  });
  store.on(["presence"], () => {
    const { presence } = store.facts;
    if (!presence) return;
    const isHost = presence.link === "host";
    label.textContent = isHost ? "Join under another name" : presence.name ? "Change your name" : `Your name, to ${DOES[presence.link]}`;
    refusal.textContent = presence.refusal;
    refusal.hidden = !presence.refusal;
    if (document.activeElement !== input) input.value = presence.refusal || isHost ? "" : presence.name;
  });
  return { form, input };
}
