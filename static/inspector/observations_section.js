/** Observations: results of other programs, shown over the pictures, judged by the footage, and taken as poses. */

import { make, textButton } from "../widgets/elements.js";
import { download } from "../widgets/downloads.js";
import { capital, count, displayName, percent } from "../widgets/text.js";
import { importForm } from "./import_form.js";
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
 * @returns {import("./inspector.js").Section & {bindings: (reveal: () => void) => import("../widgets/key_matching.js").Command[]}}
 */
export function observationsSection({ store, send, notify, navigation, actions, layers }, panes, sessions) {
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
  const judge = textButton("Judge", "Track the people from these observations in the background, and say where the footage contradicts them", () => act("judge", current()));
  judge.className = "is-primary";
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
  const stop = textButton("Stop", "Stop this work", () => (found()?.running ? act("stop") : send({ type: "find_people", action: "stop" })));
  const progress = make("progress");
  const work = group(progress, stop);
  const status = sectionNote();
  status.setAttribute("role", "status");
  const verdict = make("div");
  const worst = make("ol", "observed-worst");
  const more = textButton("More", "List less severe entries too", () => {
    listed = Infinity;
    showWorst();
  });
  const form = importForm(store, sessions, () => act("discard"));
  const body = make("div", "acquisition", none, list, detecting, buttons, tracking, work, status, verdict, worst, more, form.element);

  /** Whether the last search for people was begun here. */
  let isTracking = false;
  const startTrack = () => {
    isTracking = true;
    act(/** @type {Action} */ (evidence.value), current());
  };

  let listed = FEW_LISTED;
  let at = -1;
  /** @type {JudgedLimb[] | null} the entries that are listed */
  let entries = null;
  /** @type {JudgedLimb | null} the entry whose joint is zoomed to once its frame is drawn */
  let zoom = null;

  /**
   * @param {string} address of a file
   * @param {string} what it is, to begin a sentence
   */
  const save = async (address, what) => {
    try {
      const name = await download(address);
      notify({ type: "notice", level: "info", text: `Saved ${name}.` });
    } catch (error) {
      const reason = error instanceof TypeError ? "the program cannot be reached" : String(/** @type {Error} */ (error).message);
      notify({ type: "notice", level: "error", text: `${what} failed: ${reason}` });
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
    if (rank >= listed) listed = Infinity;
    if (observations.shown !== observations.judged) act("show", observations.judged);
    navigation.pause();
    navigation.goTo(entry.frame);
    const point = info.points.includes(entry.joint) ? entry.joint : null;
    if (state?.person !== entry.person || state.point !== point) actions.selectPerson(entry.person, point);
    zoom = entry;
    zoomNow();
    showWorst();
  };

  const zoomNow = () => {
    const { overlay, shown, session, target } = store.facts;
    if (zoom && target !== zoom.frame) zoom = null;
    if (!zoom || overlay?.frame !== zoom.frame || shown?.frame !== zoom.frame) return;
    const info = session?.people[zoom.person];
    const limb = info?.point_limbs[zoom.joint]?.name;
    panes.grid.frameJoints(zoom.person, info?.points.filter((point) => limb && info.point_limbs[point]?.name === limb) ?? []);
    zoom = null;
  };

  const showSets = (/** @type {Observations} */ { sets, shown }) => {
    none.hidden = sets.length > 0;
    list.replaceChildren(
      ...sets.map((set) => {
        const row = make("li");
        const what = set.problem || `${set.format}, ${set.is_in_space ? "joints" : "key points"} of ${set.people.join(", ")}, ${count(set.frames)} frames`;
        const text = make("span", {}, make("b", {}, set.name), sectionNote(what));
        text.lastElementChild?.classList.toggle("is-failed", !!set.problem);
        const toggle = textButton("Show", `Draw the points of ${set.name} over the pictures (toggle)`, () => show(set.name));
        toggle.setAttribute("aria-pressed", String(set.name === shown));
        toggle.setAttribute("aria-label", `Show ${set.name}`);
        toggle.disabled = !!set.problem;
        row.append(text, toggle);
        return row;
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
    work.hidden = !search.running;
    progress.value = search.share;
    status.textContent = search.running ? `${capital(search.stage)} …` : search.message;
    status.hidden = !status.textContent;
    status.classList.toggle("is-failed", search.failed);
  };

  const showWorst = () => {
    const all = found()?.worst ?? [];
    const several = (store.facts.session?.people.length ?? 1) > 1;
    worst.replaceChildren(
      ...all.slice(0, listed).map((entry, rank) => {
        const row = make("li");
        const who = several ? `${store.facts.session?.people[entry.person]?.name}, ` : "";
        const go = textButton("", `Go to frame ${entry.frame} and select the ${displayName(entry.joint)}`, () => visit(rank));
        go.append(
          make("span", "observed-frame", String(entry.frame)),
          make("span", {}, `${who}${entry.reason}`),
          make("span", "quiet", percent(entry.probability)),
        );
        go.dataset.noCommand = "";
        if (rank === at) go.setAttribute("aria-current", "true");
        row.append(go);
        return row;
      }),
    );
    worst.hidden = all.length === 0;
    more.hidden = all.length <= listed;
    more.textContent = `${count(all.length - listed)} more`;
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
    if (news !== JSON.stringify(entries)) {
      [entries, listed, at] = [now.worst, FEW_LISTED, -1];
      showWorst();
    }
    form.show();
  };
  showAll();
  body.hidden = false;

  store.on(["observations", "session"], showAll);
  store.on(["finding"], () => found() && showWork(/** @type {Observations} */ (found())));
  store.on(["overlay", "target"], zoomNow);
  return {
    id: "observations",
    title: "Observations",
    hint: "Key points, joints and masks of other programs: import, judge, mend",
    body,
    bindings(reveal) {
      const noSet = () => (current() ? null : NO_SET);
      const busy = () => (found()?.running ? "Work on observations is under way." : store.facts.finding?.running ? "A search for people is under way." : noSet());
      const noEntry = () => (found()?.worst.length ? null : found()?.judged ? "No imported limb is off." : "Nothing was judged. Judge the observations first.");
      const step = (/** @type {1 | -1} */ way) => visit(Math.max(0, Math.min((found()?.worst.length ?? 0) - 1, at + way)));
      const command = (/** @type {string} */ label, /** @type {string} */ words, /** @type {() => string | null} */ why, /** @type {() => void} */ run) => ({
        keys: [],
        label,
        words: `${words} observations imported detector`,
        why,
        run: () => {
          reveal();
          run();
        },
      });
      return [
        {
          keys: ["Alt J"],
          label: "Observations of other programs",
          area: "Views",
          words: "imported key points joints openpose trc judge detector",
          run: reveal,
        },
        { keys: ["Alt Shift ↓"], label: "Next imported limb that is off", area: "Timeline", words: "judge worst", why: noEntry, run: () => step(1) },
        { keys: ["Alt Shift ↑"], label: "Previous imported limb that is off", area: "Timeline", words: "judge worst", why: noEntry, run: () => step(-1) },
        command("Show imported points (toggle)", "layer key points", noSet, () => show(current())),
        command("Judge the observations by the footage", "wrong off worst", busy, () => act("judge", current())),
        command("Take the observations as poses", "store mend correct", busy, () => act("take", current())),
        command("Track with the observations", "contours evidence find people", busy, startTrack),
        command("Send the observations back as they came", "export save file mended", noSet, () => void save(`export/like/${encodeURIComponent(current())}`, "The export")),
        command("Write the report of the judgement", "html save file", () => (found()?.judged ? null : "Nothing was judged. Judge the observations first."), () => void writeReport()),
        command("Import observations…", "key points joints masks files openpose trc", () => null, form.open),
      ];
    },
  };
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

/** @param {HTMLElement[]} parts */
function group(...parts) {
  return make("div", "acquisition-work", ...parts);
}
