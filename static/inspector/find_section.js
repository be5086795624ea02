/** Find people: one button from a new recording to a tracked one, its progress, and what was found. */

import { make, textButton } from "../widgets/elements.js";
import { StepsBar } from "../widgets/steps_bar.js";
import { workRow } from "./parts.js";
import { sectionNote } from "./rows.js";

/** Number of the latest sentences that are shown. */
const SHOWN = 8;

/**
 * @param {import("../model/index.js").Context} context
 * @returns {import("./inspector.js").Section & {find: () => void, detect: () => void}}
 */
export function findSection({ store, send, layers }) {
  const find = () => send({ type: "find_people", action: "start" });
  const start = textButton("Find people", "Find everybody whom nobody has placed, acquire their sizes and track them; one step to undo", () =>
    find(),
  );
  const network = (/** @type {"detect_track" | "stop"} */ action) => send({ type: "observations", action, name: "" });
  const detect = () => {
    isDetecting = true;
    layers.toggle(["imported"], true);
    network("detect_track");
  };
  const detectButton = textButton("Detect and track", "Let a network find the people in the pictures, then track them by its key points and the contours", detect);
  const offer = sectionNote("No camera has a background or masks: let a network find the people, or find them by what moves.");
  const work = workRow("Stop; what was found and tracked stays", () => (store.facts.finding?.running ? send({ type: "find_people", action: "stop" }) : network("stop")));
  const steps = new StepsBar();
  const take = textButton("Take this pose", "End the search, and go on with the best pose so far: sizes, then tracking", () =>
    send({ type: "find_people", action: "take" }),
  );
  const notes = make("ul", "find-notes");
  const details = make("details", {}, make("summary", { title: "Each frame that was tried, and who was found" }, "Details"), notes);
  const body = make("div", "acquisition", offer, detectButton, start, steps.element, work.element, work.status, take, details);

  /** Whether the last work that was begun here is that of a network. */
  let isDetecting = false;
  let wasRunning = false;
  const show = () => {
    const { finding, observations, session } = store.facts;
    if (finding?.running) isDetecting = false;
    const now = isDetecting ? observations : finding;
    const running = now?.running ?? false;
    const hasOutlines = session?.has_outlines ?? true;
    offer.hidden = running || hasOutlines;
    start.hidden = detectButton.hidden = running;
    start.classList.toggle("is-primary", hasOutlines);
    detectButton.classList.toggle("is-primary", !hasOutlines);
    work.show(now);
    const chain = store.facts.advice?.said.find((advice) => advice.steps.length);
    steps.show(chain?.steps ?? [], chain?.step ?? 0, chain?.share ?? 0);
    work.progress.hidden = chain !== undefined;
    take.hidden = !chain?.actions.some(({ deed }) => deed === "take_found");
    details.hidden = !finding?.notes.length;
    if (running !== wasRunning) details.open = !running && !finding?.failed; // sentences on the people who were found
    wasRunning = running;
    notes.replaceChildren(...(finding?.notes ?? []).slice(-SHOWN).map((text) => make("li", {}, text)));
  };
  show();
  store.on(["finding", "observations", "session", "advice"], show);
  return { id: "find", title: "Find people", hint: "First poses, sizes and a track with nobody's help", body, find, detect };
}
