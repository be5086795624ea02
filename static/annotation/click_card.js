/** The next best click: asked for, gone to, with its reason and its gain in words. */

import { make, textButton } from "../widgets/elements.js";
import { capital } from "../widgets/text.js";

/** @typedef {import("../model/protocol.js").ClickProposal} Proposal */

/**
 * @param {import("../model/index.js").Context} context
 * @param {import("./visits.js").Visits} visits
 */
export function clickCard({ store, send }, visits) {
  const proposal = () => store.facts.annotation?.proposal;
  /** Number of the answer to go to; null while none is awaited. @type {number | null} */
  let awaited = null;
  const ask = () => {
    const now = proposal();
    if (!now || now.running) return;
    awaited = now.number + 1;
    send({ type: "annotation", action: "next_click" });
    show();
  };
  const button = textButton("Next best click", "Go to the frame and limb where a correction lowers the expected error most", ask);
  const again = textButton("Show it", "Go to the proposed limb again", () => visit());
  const buttons = make("div", "plan-buttons click-card", button, again);
  const text = make("p", { className: "section-note click-card", role: "status" });

  const visit = () => {
    const click = proposal()?.click;
    if (click) visits.go(click);
  };

  const show = () => {
    const now = proposal();
    const isBusy = !!now?.running || (awaited !== null && (now?.number ?? 0) < awaited);
    const isAnswered = awaited !== null && !isBusy;
    if (isAnswered) {
      awaited = null;
      visit();
    }
    button.disabled = isBusy;
    again.hidden = isBusy || !now?.click;
    const views = now?.click?.cameras.map((camera) => store.facts.session?.cameras[camera]?.name).join(" and ") ?? "";
    text.textContent = isBusy ? "Looking for the next best click …" : now ? describe(now, views) : "";
    text.hidden = !text.textContent;
    text.classList.toggle("is-failed", !isBusy && !!now?.message);
    if (isAnswered) text.scrollIntoView({ block: "center" }); // sections above may still grow
  };

  return { elements: [buttons, text], text, ask, show, why: () => (proposal()?.running ? "The next best click is being looked for." : null) };
}

/**
 * @param {Proposal} proposal
 * @param {string} views names of the views to correct the limb in
 */
export function describe({ message, click, error_mm, interval_mm, after_mm }, views) {
  if (message) return message;
  if (error_mm === null || !interval_mm) return "";
  const error = `expected error ${error_mm.toFixed(1)} mm (${interval_mm.map((value) => value.toFixed(1)).join(" to ")}, 90 %)`;
  const gain = after_mm === null ? "" : gained(error_mm, after_mm);
  if (!click) return `Nothing is left that pays: ${error}.${gain}`;
  return `${capital(click.reason)}. Correct it in ${views}: gains ${click.gain_mm.toFixed(2)} mm of the ${error}.${gain}`;
}

/**
 * @param {number} before mm
 * @param {number} after mm
 */
function gained(before, after) {
  const fall = before - after;
  return ` Now ${after.toFixed(1)} mm expected: ${fall < 0.005 ? "no gain yet" : `${fall.toFixed(2)} mm gained`}.`;
}
