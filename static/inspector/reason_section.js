/** Reason for a doubt: what each view shows of each part of the shown pose, as a table whose cells zoom to the part. */

import { checkbox, make, textButton } from "../widgets/elements.js";
import { alternativesOf } from "../model/selectors.js";
import { capital } from "../widgets/text.js";
import { MEASURES, reasonTable } from "./reason_table.js";
import { triedTable } from "./tried_table.js";

/** @typedef {import("./reason_table.js").Measure} Measure */

const STORED = "quadrille.reason-measure";
/**
 * @param {import("../model/index.js").Context} context
 * @param {import("../panes/index.js").Panes} panes
 * @param {import("../posing/index.js").PosingRoom} room
 * @returns {import("./inspector.js").Section}
 */
export function reasonSection({ store, send }, { grid }, { posing }) {
  const body = make("div", "reason");
  const sentence = make("p", { className: "reason-sentence", "aria-live": "polite" });
  const progress = make("progress");
  const stop = textButton("Stop", "Stop learning what is usual in this run; nothing changes", () => send({ type: "reason", action: "stop" }));
  const stage = make("span", "section-note");
  const work = make("div", "acquisition-work", progress, stop);
  const message = make("p", "section-note");
  const again = textButton("Explain this pose", "Learn what is usual in this run, and compare this pose with it", () => ask());
  const notes = make("p", "section-note");
  let measure = MEASURES.find(({ id }) => id === localStorage.getItem(STORED)) ?? MEASURES[0];
  const choice = measureChoice(measure, (chosen) => {
    measure = chosen;
    localStorage.setItem(STORED, measure.id);
    show();
  });
  const table = reasonTable({
    point: (cell) => store.set({ hoverPart: cell }),
    zoom: (cell) => grid.framePart(cell),
  });
  const others = make("ol", { className: "reason-others", "aria-label": "Alternative poses" });
  let listed = "";
  const tried = triedTable();
  body.append(sentence, stage, work, others, message, again, choice, table.element, notes, tried.element);

  let isAsking = false;
  const ask = () => {
    isAsking = true;
    send({ type: "reason", action: "ask" });
  };
  /** Ask for the reason while the section is in sight. */
  const follow = () => {
    const isSeen = store.facts.connected && body.getClientRects().length > 0;
    if (isSeen === isAsking) return;
    if (isSeen) ask();
    else {
      isAsking = false;
      if (store.facts.connected) send({ type: "reason", action: "leave" });
    }
  };
  new ResizeObserver(follow).observe(body);

  const show = () => {
    const { reason, session, state } = store.facts;
    const person = session?.people[reason?.person ?? 0];
    const isKnown = !!reason && reason.parts.length > 0;
    const hasWork = reason?.running ?? false;
    work.hidden = stage.hidden = !hasWork;
    progress.value = reason?.share ?? 0;
    stage.textContent = capital(reason?.stage ?? "");
    message.textContent = hasWork ? "" : (reason?.message ?? "");
    message.hidden = !message.textContent;
    again.hidden = hasWork || isKnown || !message.textContent;
    sentence.hidden = !isKnown;
    sentence.textContent = isKnown ? reason.sentence ? `${capital(reason.sentence)}.` : noContradiction(state?.status ?? "") : "";
    sentence.classList.toggle("is-doubt", isKnown && reason.sentence !== "");
    choice.hidden = table.element.hidden = !isKnown && !hasWork;
    const ranked = alternativesOf(store.facts);
    others.hidden = ranked.length === 0;
    if (JSON.stringify(ranked) !== listed) {
      listed = JSON.stringify(ranked);
      others.replaceChildren(...ranked.map((other, rank) => alternativeRow(other, rank, () => posing.takeAlternative(rank))));
    }
    notes.textContent = isKnown ? reason.notes.join(" ") : "";
    notes.hidden = !notes.textContent;
    tried.show(state?.source ? (reason?.tried ?? null) : undefined);
    table.element.classList.toggle("is-former", !isKnown);
    if (isKnown && person && session) table.show({ reason, measure, person, cameras: session.cameras });
    else if (!hasWork) table.clear();
  };
  show();
  store.on(["connected"], () => {
    isAsking &&= store.facts.connected;
    follow();
  });
  store.on(["reason", "session", "state", "connected"], show);
  return { id: "reason", title: "Reason", hint: "Why this pose is in doubt: what each view shows of each part", body };
}

/**
 * @param {import("../model/protocol.js").GhostPose} other
 * @param {number} rank
 * @param {() => void} take
 */
function alternativeRow({ nats, limbs }, rank, take) {
  const where = limbs.length ? `${limbs.join(", ")} elsewhere` : "body elsewhere";
  const cost = `${Math.abs(nats).toFixed(Math.abs(nats) < 10 ? 1 : 0)} nats ${nats < 0 ? "better" : "worse"}`;
  const title = `Take this pose, drawn blue with the number ${rank + 1}. Can be undone`;
  return make("li", {}, textButton(`Take ${rank + 1}`, title, take), make("span", {}, `${where}: ${cost}`));
}

/** @param {string} status */
function noContradiction(status) {
  const more = status === "doubtful" || status === "lost" ? " The status comes from other poses of the whole run that may be as likely." : "";
  return `No view contradicts this pose clearly.${more}`;
}

/**
 * @param {Measure} chosen
 * @param {(measure: Measure) => void} change
 */
function measureChoice(chosen, change) {
  const choices = MEASURES.map((measure) => {
    const { label, title } = measure;
    return checkbox(label, title, { type: "radio", name: "reason-measure", checked: measure === chosen, onchange: () => change(measure) }).element;
  });
  return make("fieldset", { className: "segmented", "aria-label": "Measure" }, ...choices);
}
