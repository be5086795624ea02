/**
 * Inspector: a column beside the views with the selected joint, body sizes, settings and what the 3-D view shows.
 *
 * The room imports `widgets`, `model`, types of `panes`, `timeline` and `scene`, and `posing`.
 */

import { button } from "../widgets/elements.js";
import { command, inArea } from "../widgets/key_matching.js";
import { capital } from "../widgets/text.js";
import { calibrationSection } from "./calibration_section.js";
import { clocksSection } from "./clocks_section.js";
import { copySection } from "./copy_section.js";
import { findSection } from "./find_section.js";
import { bodySection } from "./body_section.js";
import { Inspector } from "./inspector.js";
import { jointSection } from "./joint_section.js";
import { observationsSection } from "./observations_section.js";
import { provenanceSection } from "./provenance_section.js";
import { reasonSection } from "./reason_section.js";
import { searchSection } from "./search_section.js";
import { trackSection } from "./track_section.js";
import { viewSection } from "./view_section.js";

/** @type {import("../model/theme.js").ThemeChoice[]} */
const THEMES = ["dark", "light", "system"];

/** @typedef {ReturnType<typeof mount>} InspectorRoom */

/**
 * Build the column.
 *
 * @param {import("../model/index.js").Context} context
 * @param {{panes: import("../panes/index.js").Panes, posing: import("../posing/index.js").PosingRoom,
 *   timeline: import("../timeline/index.js").TimelineRoom, scene: import("../scene/index.js").SceneRoom, sessions: import("./import_form.js").PathFields}} rooms
 */
export function mount(context, { panes, posing, timeline, scene, sessions }) {
  const joint = jointSection(context, posing);
  const finding = findSection(context);
  /** @type {import("./inspector.js").Section[]} */
  const sections = [
    joint,
    reasonSection(context, panes, posing),
    finding,
    bodySection(context),
    trackSection(context),
    searchSection(context),
    calibrationSection(context),
    clocksSection(context),
    observationsSection(context, panes, sessions),
    provenanceSection(context, timeline),
    copySection(context, timeline, sessions),
    viewSection(context, scene, panes),
  ];
  const inspector = new Inspector(context.store, sections);
  const findPeople = () => {
    inspector.reveal("find"); // which offers a network first where only what moves shows the people
    if (context.store.facts.session?.has_outlines) finding.find();
  };
  const detect = () => {
    inspector.reveal("find");
    finding.detect();
  };
  button("show-reason", () => inspector.reveal("reason"));
  const bindings = inArea("Inspector", [
    { label: "Inspector: sizes, settings (toggle)", words: "body", run: () => inspector.toggle() },
    command("Why this pose is in doubt", "reason explain evidence colours outside silhouette contour nats parts views", () => inspector.reveal("reason")),
    command("Cost over two angles of the joint", "landscape map nats inspector", () => (inspector.reveal("joint"), joint.openMap())),
    command("Find people", "start automatically initialize bootstrap first pose acquire track nobody placed", findPeople),
    ...sections.flatMap(({ id, bindings }) => bindings?.(() => inspector.reveal(id)) ?? []),
    ...sections.filter(({ id }) => !["find", "reason", "observations"].includes(id)).map(({ id, title, hint }) =>
      command(id === "view" ? "View settings: theme, 3-D view" : title, `${hint} inspector settings`, () => inspector.reveal(id)),
    ),
    ...THEMES.map((choice) => command(`${capital(choice)} theme`, "colour scheme mode appearance", () => context.themes.choose(choice))),
  ]);
  return { inspector, findPeople, detect, bindings };
}
