/** Find people: one button from a new recording to a tracked one, its progress, and what was found. */

import { textButton } from "./rows.js";

/** Number of the latest sentences that are shown. */
const SHOWN = 8;

/**
 * @param {import("../model/index.js").Context} context
 * @returns {import("./inspector.js").Section}
 */
export function findSection({ store, send }) {
  const find = (/** @type {"start" | "stop"} */ action) => send({ type: "find_people", action });
  const start = textButton("Find people", "Find everybody whom nobody has placed, acquire their sizes and track them; one step to undo", () =>
    find("start"),
  );
  start.className = "is-primary";
  const stop = textButton("Stop", "Stop; what was found and tracked stays", () => find("stop"));
  const progress = document.createElement("progress");
  const work = document.createElement("div");
  work.className = "acquisition-work";
  work.append(progress, stop);
  const status = document.createElement("p");
  status.className = "section-note";
  status.setAttribute("role", "status");
  const notes = document.createElement("ul");
  notes.className = "find-notes";
  const details = document.createElement("details");
  details.append(Object.assign(document.createElement("summary"), { textContent: "Details", title: "Each frame that was tried, and who was found" }), notes);
  const body = document.createElement("div");
  body.className = "acquisition";
  body.append(start, work, status, details);

  let wasRunning = false;
  const show = () => {
    const { finding } = store.facts;
    const running = finding?.running ?? false;
    start.hidden = running;
    work.hidden = !running;
    progress.value = finding?.share ?? 0;
    status.textContent = !finding ? "" : running ? `${finding.stage} …` : finding.message;
    status.hidden = !status.textContent;
    status.classList.toggle("is-failed", finding?.failed ?? false);
    details.hidden = !finding?.notes.length;
    if (running !== wasRunning) details.open = !running && !finding?.failed; // sentences on the people who were found
    wasRunning = running;
    notes.replaceChildren(
      ...(finding?.notes ?? []).slice(-SHOWN).map((text) => Object.assign(document.createElement("li"), { textContent: text })),
    );
  };
  show();
  return {
    id: "find",
    title: "Find people",
    hint: "First poses, sizes and a track with nobody's help",
    body,
    update: (changed) => changed.has("finding") && show(),
  };
}
