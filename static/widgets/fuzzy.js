/** Score how well typed letters match a text: starts of words first, then parts of words, then scattered letters. */

const START = 30;
const WORD = 20;
const INSIDE = 10;

/**
 * @param {string} query words in any order
 * @param {string} text
 * @returns {number | null} a higher score is better; null if a word of the query does not match
 */
export function fitness(query, text) {
  const there = text.toLowerCase();
  let total = 0;
  for (const word of query.toLowerCase().split(/\s+/).filter(Boolean)) {
    const found = wordFitness(word, there);
    if (found === null) return null;
    total += found;
  }
  return total - there.length / 200;
}

/**
 * @param {string} word
 * @param {string} text
 */
function wordFitness(word, text) {
  if (text.startsWith(word)) return START;
  const at = text.search(new RegExp(`(^|[^a-z0-9])${word.replace(/[^a-z0-9]/g, "\\$&")}`));
  if (at >= 0) return WORD - at / 100;
  const inside = text.indexOf(word);
  if (inside >= 0) return INSIDE - inside / 100;
  return scattered(word, text);
}

/**
 * Match letters of one word of the text in their order, from its first on. Fewer letters between them are better.
 *
 * @param {string} word
 * @param {string} text
 */
function scattered(word, text) {
  const letters = [...word].map((letter) => letter.replace(/[^a-z0-9]/, "\\$&"));
  const found = new RegExp(`(?<![a-z0-9])${letters.join("[a-z0-9]*?")}`).exec(text)?.[0].length ?? Infinity;
  return found <= 3 * word.length ? 5 - (found - word.length) / 10 : null;
}
