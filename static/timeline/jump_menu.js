/** Buttons that go to doubtful frames, and a menu of other kinds of frames to go to. */

import { button, byId, iconButton, make } from "../widgets/elements.js";
import { KINDS } from "./jumps.js";
import { count } from "../widgets/text.js";

const PREVIOUS = "M10 3.5 5 8l5 4.5";
const NEXT = "m6 3.5 5 4.5-5 4.5";

/**
 * @param {import("../model/store.js").Store} store
 * @param {import("./jumps.js").Jumps} jumps
 * @param {() => void} listDoubts opens the list of doubts
 */
export function mountJumpMenu(store, jumps, listDoubts) {
  const menu = byId("jump-menu", HTMLElement);
  /** @type {Map<import("./jumps.js").Kind, {count: HTMLElement, buttons: HTMLButtonElement[]}>} */
  const rowsByKind = new Map();
  const gap = { type: /** @type {const} */ ("button"), className: "jump-gap", title: "Go to the middle of the longest gap between keyframes, the best place for a new one" };
  const gapButton = make("button", { ...gap, onclick: () => jumps.toLongestGap() }, "Longest gap between keyframes");
  const previous = button("previous-doubt", () => jumps.go("doubt", -1));
  const next = button("next-doubt", () => jumps.go("doubt", 1));
  const open = button("show-jumps", () => show(menu.hidden));
  build();
  document.addEventListener("pointerdown", (event) => {
    const at = /** @type {Node} */ (event.target);
    if (!menu.contains(at) && !open.contains(at)) show(false);
  });
  // A click into the 3-D view is noticed only as a loss of focus.
  addEventListener("blur", () => show(false));
  // Opened by the mouse, the menu has no focus. Esc closes it all the same, and does nothing else.
  const closes = (/** @type {KeyboardEvent} */ event) => {
    if (event.key !== "Escape" || menu.hidden) return;
    event.preventDefault();
    event.stopPropagation();
    const hadFocus = menu.contains(document.activeElement);
    show(false);
    if (hadFocus) open.focus();
  };
  document.addEventListener("keydown", closes, true);
  store.on(["timeline", "disagreeing", "calibration", "otherCopy", "provenanceFilter", "annotators", "connected", "session"], countAll);

  function build() {
    const rows = KINDS.map(({ kind, label, title, more, keys }) => {
      const row = make("div", { className: "jump-row", title });
      const name = make("span", {}, label);
      const number = make("output", { "aria-label": `Number of frames: ${label}` });
      const [onward, back] = keys?.map(([key]) => ` (${key.replace(" ", "+")})`) ?? ["", ""];
      const buttons = [
        iconButton(PREVIOUS, `Previous ${more}${back}`, () => jumps.go(kind, -1)),
        iconButton(NEXT, `Next ${more}${onward}`, () => jumps.go(kind, 1)),
      ];
      row.append(name, number, make("div", "group", ...buttons));
      rowsByKind.set(kind, { count: number, buttons });
      return row;
    });
    const title = "List doubtful and lost poses with thumbnails, most severe first";
    menu.append(...rows, gapButton, make("button", { type: "button", className: "jump-list", title, onclick: toList }, "List doubts by severity"));
  }

  function toList() {
    show(false);
    listDoubts();
  }

  /** @param {boolean} isShown */
  function show(isShown) {
    menu.hidden = !isShown;
    open.setAttribute("aria-expanded", String(isShown));
    if (isShown) countAll();
  }

  function countAll() {
    const { connected, session } = store.facts;
    previous.disabled = next.disabled = !connected || jumps.count("doubt") === 0;
    open.disabled = !connected || !session;
    if (menu.hidden) return;
    for (const [kind, { count: number, buttons }] of rowsByKind) {
      const found = jumps.count(kind);
      number.textContent = count(found);
      for (const one of buttons) one.disabled = found === 0;
    }
    const gap = jumps.longestGap();
    gapButton.disabled = !gap;
    gapButton.textContent = gap
      ? `Longest gap between keyframes: ${count(gap.last - gap.first + 1)}`
      : "Every frame is a keyframe";
  }
}
