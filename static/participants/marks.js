/** How a person is marked: a colour by the order of joining, and initials. */

const N_COLORS = 4;

/** @typedef {import("../model/protocol.js").PresentPerson} PresentPerson */

/** @param {number} index in the list of those who are here */
export function colorOf(index) {
  return `var(--series-${index % N_COLORS})`;
}

/** @param {PresentPerson} person */
export function nameOf({ name }) {
  return name || "Host";
}

/** @param {PresentPerson} person */
export function initialsOf(person) {
  const words = nameOf(person).split(/\s+/);
  const letters = words.length > 1 ? [words[0], words[words.length - 1]] : words;
  return letters.map((word) => [...word][0]).join("").toUpperCase();
}
