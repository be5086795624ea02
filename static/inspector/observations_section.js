/** Observations: results of other programs, shown over the pictures, judged by the footage, and taken as poses. */

import { make, textButton } from "../widgets/elements.js";
import { download } from "../widgets/downloads.js";
import { capital, count, percent } from "../widgets/text.js";
import { importForm } from "./import_form.js";
import { zoomOnArrival } from "../panes/arrival_zoom.js";
import { group, jointRow, longList, workRow } from "./parts.js";
import { command } from "../widgets/key_matching.js";
import { sectionNote } from "./rows.js";

/**
 * @typedef {import("../model/protocol.js").ObservationsMessage} Observations
 * @typedef {import("../model/protocol.js").JudgedLimb} JudgedLimb
 * @typedef {import("../model/protocol.js").UseObservations["action"]} Action
 */

/** Entries of the list that are built at first, and after "more". */
const FEW_LISTED = 20;
const NO_SET = "No observations were imported. Import them first.";

/**
 * @param {import("../model/index.js").Context} context
 * @param {import("../panes/index.js").Panes} panes
 * @param {import("./import_form.js").PathFields} sessions
 * @returns {import("./inspector.js").Section}
 */
export function observationsSection({ store, send, say, navigation, actions, layers }, panes, sessions) {
  const act = (/** @type {Action} */ action, name = "") => send({ type: "observations", action, name });
  const found = () => store.facts.observations;
  /** Name of the set that buttons concern: the shown one, else the first that can be read. */
  const current = () => found()?.shown || found()?.sets.find(({ problem }) => !problem)?.name || "";
  const show = (/** @type {string} */ name) => {
    act("show", found()?.shown === name ? "" : name);
    layers.toggle(["imported"], true);
  };

  const list = make("ul", "observed-sets");
  const none = sectionNote("Key points and joints of other programs: import them, see where they are wrong, and mend that.");
  const judge = textButton("Judge", "Track the people from these observations in the background, and say where the footage contradicts them", () => act("judge", current()), { className: "is-primary" });
  const take = textButton("Take as poses", "Store them as poses that can be corrected; keyframes stay, and undo takes them back", () => act("take", current()));
  const report = textButton("Write report", "Save the judgement as one HTML file with pictures of the worst frames", () => void writeReport());
  const detect = textButton("Detect people", "Let a network find the key points of people on all frames, where no background shows them; docs/observations.md says how to get it", () => {
    layers.toggle(["imported"], true);
    act("detect");
  });
  const detecting = group(detect);
  const buttons = group(judge, take, report);
  const evidence = make("select", { title: "Evidence of the run. For poses by the key points alone, take them as poses", "aria-label": "Evidence" }, new Option("contours and points", "track"), new Option("contours alone", "track_contours"));
  const track = textButton("Track by", "Find who has no pose by these points, acquire their sizes, and track everybody on all frames; one step to undo", () => startTrack());
  const tracking = group(track, evidence);
  const work = workRow("Stop this work", () => (found()?.running ? act("stop") : send({ type: "find_people", action: "stop" })));
  const verdict = make("div");
  const worst = make("ol", "observed-worst");
  const entryRow = (/** @type {JudgedLimb} */ entry, /** @type {number} */ rank) =>
    jointRow(store.facts.session?.people ?? [], entry, rank === at, () => visit(rank), [entry.reason, percent(entry.probability)]);
  const entries = longList(worst, FEW_LISTED, "List less severe entries too", entryRow);
  const form = importForm(store, sessions, () => act("discard"));
  const body = make("div", "acquisition", none, list, detecting, buttons, tracking, work.element, work.status, verdict, ...entries.elements, form.element);

  /** Whether the last search for people was begun here. */
  let isTracking = false;
  const startTrack = () => {
    isTracking = true;
    act(/** @type {Action} */ (evidence.value), current());
  };

  let at = -1;
  /** The entries that are listed. */
  let listed = "";
  const zoomTo = zoomOnArrival(store, panes.grid);

  /**
   * @param {string} address of a file
   * @param {string} what it is, to begin a sentence
   */
  const save = async (address, what) => {
    try {
      say(`Saved ${await download(address)}.`);
    } catch (error) {
      const reason = error instanceof TypeError ? "the program cannot be reached" : String(/** @type {Error} */ (error).message);
      say(`${what} failed: ${reason}`, "error");
    }
  };
  const writeReport = async () => {
    report.disabled = true;
    await save("observations/report", "The report");
    report.disabled = false;
  };

  /** @param {number} rank of the entry of the list to go to */
  const visit = (rank) => {
    const { observations, session, state } = store.facts;
    const entry = observations?.worst[rank];
    const info = entry && session?.people[entry.person];
    if (!entry || !info) return;
    at = rank;
    if (observations.shown !== observations.judged) act("show", observations.judged);
    navigation.pause();
    navigation.goTo(entry.frame);
    const point = info.points.includes(entry.joint) ? entry.joint : null;
    if (state?.person !== entry.person || state.point !== point) actions.selectPerson(entry.person, point);
    const limb = info.point_limbs[entry.joint]?.name;
    zoomTo({ ...entry, points: info.points.filter((one) => limb && info.point_limbs[one]?.name === limb) });
    showWorst();
  };

  const showSets = (/** @type {Observations} */ { sets, shown }) => {
    none.hidden = sets.length > 0;
    list.replaceChildren(
      ...sets.map((set) => {
        const what = set.problem || `${set.format}, ${set.is_in_space ? "joints" : "key points"} of ${set.people.join(", ")}, ${count(set.frames)} frames`;
        const text = make("span", {}, make("b", {}, set.name), sectionNote(what));
        text.lastElementChild?.classList.toggle("is-failed", !!set.problem);
        const toggle = textButton("Show", `Draw the points of ${set.name} over the pictures (toggle)`, () => show(set.name), {
          "aria-pressed": String(set.name === shown), "aria-label": `Show ${set.name}`, disabled: !!set.problem,
        }); // prettier-ignore
        return make("li", {}, text, toggle);
      }),
    );
  };

  /** Show the work that is under way, or how the last one ended. */
  const showWork = (/** @type {Observations} */ now) => {
    const { finding } = store.facts;
    const search = isTracking && !now.running && finding ? finding : now;
    const isSearching = finding?.running ?? false;
    buttons.hidden = tracking.hidden = !current() || now.running || isSearching;
    detecting.hidden = now.running || isSearching;
    work.show({ ...search, stage: capital(search.stage) });
  };

  const showWorst = (isNew = false) => {
    entries.show(found()?.worst ?? [], isNew, at);
    worst.querySelector("[aria-current]")?.scrollIntoView({ block: "nearest" });
  };

  const showAll = () => {
    const now = found();
    if (!now) return;
    showSets(now);
    if (now.running) isTracking = false;
    showWork(now);
    report.hidden = !now.judged;
    verdict.replaceChildren(...now.people.flatMap((person) => describe(person, now)));
    const news = JSON.stringify(now.worst);
    if (news !== listed) {
      [listed, at] = [news, -1];
      showWorst(true);
    }
    form.show();
  };
  showAll();

  store.on(["observations", "session"], showAll);
  store.on(["finding"], () => found() && showWork(/** @type {Observations} */ (found())));
  const bindings = (/** @type {() => void} */ reveal) => {
    const noSet = () => (current() ? null : NO_SET);
    const busy = () => (found()?.running ? "Work on observations is under way." : store.facts.finding?.running ? "A search for people is under way." : noSet());
    const noEntry = () => (found()?.worst.length ? null : found()?.judged ? "No imported limb is off." : "Nothing was judged. Judge the observations first.");
    const step = (/** @type {1 | -1} */ way) => visit(Math.max(0, Math.min((found()?.worst.length ?? 0) - 1, at + way)));
    const own = (/** @type {string} */ label, /** @type {string} */ words, /** @type {() => string | null} */ why, /** @type {() => void} */ run) =>
      command(label, `${words} observations imported detector`, () => (reveal(), run()), why);
    return [
      { label: "Observations of other programs", words: "imported key points joints openpose trc judge detector", run: reveal },
      { label: "Next imported limb that is off", area: "Timeline", words: "judge worst", why: noEntry, run: () => step(1) },
      { label: "Previous imported limb that is off", area: "Timeline", words: "judge worst", why: noEntry, run: () => step(-1) },
      own("Show imported points (toggle)", "layer key points", noSet, () => show(current())),
      own("Judge the observations by the footage", "wrong off worst", busy, () => act("judge", current())),
      own("Take the observations as poses", "store mend correct", busy, () => act("take", current())),
      own("Track with the observations", "contours evidence find people", busy, startTrack),
      own("Send the observations back as they came", "export save file mended", noSet, () => void save(`export/like/${encodeURIComponent(current())}`, "The export")),
      own("Write the report of the judgement", "html save file", () => (found()?.judged ? null : "Nothing was judged. Judge the observations first."), () => void writeReport()),
      own("Import observations…", "key points joints masks files openpose trc", () => null, form.open),
    ];
  };
  const hint = "Key points, joints and masks of other programs: import, judge, mend";
  return { id: "observations", title: "Observations", hint, body, bindings };
}

/**
 * @param {import("../model/protocol.js").JudgedPerson} person
 * @param {Observations} found
 */
function describe({ name, share_in_order, frames, sentences }, { people, judged, off }) {
  const who = people.length > 1 ? `${name} in ${judged}` : judged;
  const limbs = people.length > 1 ? "" : off ? `; ${count(off)} ${off === 1 ? "limb is" : "limbs are"} off` : "";
  const texts = [`${who}: ${percent(share_in_order)} of ${count(frames)} frames in order${limbs}.`, ...sentences.map((text) => `${capital(text)}.`)];
  return texts.map(sectionNote);
}
