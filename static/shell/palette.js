/** Command palette: find commands by a few letters, run them with Enter. */

import { stored } from "../widgets/stored.js";
import { buttonCommands, contextCommands, keyCommands, settingCommands, suitingLabels } from "./commands.js";
import { byId, keyCaps, make } from "../widgets/elements.js";
import { fitness } from "../widgets/fuzzy.js";

const RECENT = "quadrille.palette.recent";
const MAX_RECENT = 12;
const MAX_SHOWN = 60;
/** Bonus of recent commands, and of those that suit the state, which ranks them before equal matches. */
const [RECENT_BONUS, SUITING_BONUS] = [6, 3];
/** Factor of a bonus without a query, when nothing else ranks commands. */
const ALONE = 1000;

/**
 * @typedef {import("./commands.js").Command} Command
 * @param {import("./commands.js").CommandContext} context
 * @param {import("../widgets/key_matching.js").Binding[]} table
 */
export function mountPalette(context, table) {
  const dialog = byId("palette", HTMLDialogElement);
  const input = byId("palette-query", HTMLInputElement);
  const list = byId("palette-list", HTMLElement);
  const why = byId("palette-why", HTMLElement);
  /** @type {Command[]} the listed commands */
  let found = [];
  let at = 0;
  input.addEventListener("input", () => search());
  input.addEventListener("keydown", (event) => onKey(event));
  dialog.addEventListener("click", (event) => event.target === dialog && dialog.close());
  list.addEventListener("click", (event) => {
    const option = event.target instanceof Element ? event.target.closest("[role=option]") : null;
    if (option) choose([...list.children].indexOf(option));
  });

  function toggle() {
    if (dialog.open) {
      dialog.close();
      return;
    }
    input.value = "";
    dialog.showModal();
    search();
  }

  function search() {
    const query = input.value;
    const isAsked = query.trim() !== "";
    const [recent, suiting] = [recentIds(), suitingLabels(context.store.facts)];
    const commands = [
      ...contextCommands(context, query),
      ...keyCommands(table),
      ...buttonCommands(table),
      ...settingCommands(context),
    ];
    const scored = commands.flatMap((command) => {
      const found = fitness(query, `${command.label} ${command.area} ${command.words} ${command.keys.join(" ")}`);
      if (found === null) return [];
      const inLabel = fitness(query, command.label) ?? 0;
      const lately = recent.indexOf(command.id);
      const fits = command.why() === null ? suiting.indexOf(command.label) : -1;
      const recency = lately < 0 ? 0 : RECENT_BONUS * (1 - lately / MAX_RECENT);
      const bonus = recency || (fits < 0 ? 0 : SUITING_BONUS * (1 - fits / suiting.length));
      const mark = isAsked ? "" : lately >= 0 ? ", recent" : fits >= 0 ? ", suits now" : "";
      return [{ command, mark, score: found + inLabel + (isAsked ? 1 : ALONE) * bonus }];
    });
    // Without a query: recent commands, those that suit the state, then the order of the table.
    scored.sort((a, b) => (isAsked || a.mark || b.mark ? b.score - a.score : 0));
    const shown = scored.slice(0, MAX_SHOWN);
    found = shown.map(({ command }) => command);
    list.replaceChildren(...shown.map(({ command, mark }, index) => option(command, mark, index)));
    list.scrollTop = 0;
    // Enter by itself must not change a pose: without a query nothing is chosen yet.
    show(isAsked ? 0 : -1);
    if (!shown.length) why.textContent = `No results for “${query}”. Enter a number to go to that frame.`;
  }

  /** @param {KeyboardEvent} event */
  function onKey(event) {
    // The field of the closed dialog keeps the focus until the page is drawn again: its keys belong to the page.
    if (!dialog.open) return;
    const count = found.length;
    const page = 8;
    const to = {
      ArrowDown: (at + 1) % Math.max(1, count),
      ArrowUp: (Math.max(at, 0) - 1 + count) % Math.max(1, count),
      PageDown: Math.min(count - 1, at + page),
      PageUp: Math.max(0, at - page),
    }[event.key];
    const isToggle = event.key.toLowerCase() === "k" && (event.ctrlKey || event.metaKey);
    if (to !== undefined) show(to);
    else if (event.key === "Enter") choose(at);
    else if (isToggle) dialog.close();
    else return;
    event.preventDefault();
  }

  /** @param {number} index */
  function show(index) {
    list.children[at]?.setAttribute("aria-selected", "false");
    at = index;
    const now = list.children[index];
    now?.setAttribute("aria-selected", "true");
    now?.scrollIntoView({ block: "nearest" });
    input.setAttribute("aria-activedescendant", now?.id ?? "");
    why.textContent = index < 0 ? "Type a few letters, or choose with ↑ and ↓." : (found[index]?.why() ?? "");
  }

  /** @param {number} index */
  function choose(index) {
    const command = found[index];
    if (!command) return;
    show(index);
    if (command.why() !== null) {
      why.classList.remove("is-asked");
      void why.offsetWidth; // restart the animation
      why.classList.add("is-asked");
      return;
    }
    const recent = [command.id, ...recentIds().filter((id) => id !== command.id)].slice(0, MAX_RECENT);
    localStorage.setItem(RECENT, JSON.stringify(recent));
    dialog.close();
    command.run();
  }

  return { toggle };
}

/**
 * @param {Command} command
 * @param {string} mark why it comes first
 * @param {number} index
 */
function option({ area, label, keys, why }, mark, index) {
  const item = make("li", { id: `palette-option-${index}`, role: "option", "aria-selected": "false" });
  const reason = why();
  if (reason !== null) {
    item.setAttribute("aria-disabled", "true");
    item.title = reason;
  }
  item.append(make("span", "is-clipped", label), make("small", {}, `${area}${mark}`), keyCaps(keys));
  return item;
}

/** @returns {string[]} */
function recentIds() {
  const found = stored(RECENT);
  return Array.isArray(found) ? found : [];
}
