/** What the buttons of the line over the views do. */

/** Sections of the inspector that show the details of some work. @type {Record<string, string>} */
const SECTIONS = { sizes: "body" };

/**
 * @typedef {import("../model/protocol.js").Action} Action
 *
 * @param {import("../model/index.js").Context} context
 * @param {import("./index.js").Rooms} rooms
 * @param {import("./export_panel.js").ExportPanel} exporting
 * @returns {(action: Action) => void}
 */
export function deeds({ store, send, say, actions, navigation, layers }, rooms, exporting) {
  const { inspector } = rooms.inspector;
  const goTo = (/** @type {number | null} */ frame) => frame !== null && frame !== store.facts.target && navigation.goTo(frame);
  const inSection = (/** @type {string} */ id, /** @type {import("../model/protocol.js").ClientMessage} */ message) => {
    inspector.reveal(id);
    send(message);
  };
  const person = (/** @type {Action} */ action) => action.person ?? store.facts.state?.person ?? 0;

  /** @type {Record<string, () => void>} */
  const stops = {
    find: () => send({ type: "find_people", action: "stop" }),
    track: () => actions.stopTracking(),
    sizes: () => send({ type: "acquire", action: "stop", person: store.facts.acquisition?.person ?? 0 }),
    calibration: () => send({ type: "calibration_check", action: "stop" }),
    clocks: () => send({ type: "clocks", action: "stop" }),
    observations: () => send({ type: "observations", action: "stop", name: "" }),
    range: () => actions.stopRange(),
    search: () => actions.search("stop"),
    export: () => exporting.cancel(),
  };

  /** @type {Record<Action["deed"], (action: Action) => void>} */
  const table = {
    accept: () => rooms.timeline.queue.accept(rooms.timeline.queue.current()),
    acquire: (action) => inSection("body", { type: "acquire", action: "start", person: person(action) }),
    apply_correction: () => send({ type: "calibration_check", action: "apply" }),
    apply_sizes: (action) => send({ type: "body_sizes", action: "apply", person: person(action), refit: true }),
    by_key_points: ({ of }) => send({ type: "observations", action: "track", name: of }),
    check_cameras: () => inSection("calibration", { type: "calibration_check", action: "start" }),
    detect: () => rooms.inspector.detect(),
    export: () => void exporting.toggle(),
    find: () => rooms.inspector.findPeople(),
    fit: () => rooms.posing.pinning.fit(),
    go_to: ({ frame }) => goTo(frame),
    place: (action) => {
      goTo(action.frame);
      actions.selectPerson(person(action), "torso");
      say("Drag the square of the body in two views, then joints. F searches around the pose, G fits the body to the edges.");
    },
    resume: () => actions.togglePause(),
    retry: () => send({ type: "save" }),
    search: () => actions.search("frame"),
    show_before: () => actions.toggleBefore(),
    show_doubt: (action) => {
      navigation.pause();
      goTo(action.frame);
      rooms.timeline.queue.arriveAt(action.frame ?? store.facts.target);
    },
    show_section: ({ of }) => inspector.reveal(SECTIONS[of] ?? of),
    show_silhouettes: ({ frame, camera }) => {
      goTo(frame);
      layers.toggle(["silhouette"], true);
      if (camera !== null) store.set({ active: camera });
    },
    show_view: ({ camera }) => camera !== null && camera !== store.facts.filled && rooms.panes.grid.toggleFill(camera),
    stop: ({ of }) => stops[of](),
    take_all_back: ({ frame }) => frame !== null && send({ type: "limb_back", frame, every: true }),
    take_found: () => send({ type: "find_people", action: "take" }),
    take_back: () => rooms.posing.pinning.takeLimbBack(),
    track: ({ frame, of }) => {
      goTo(frame);
      actions.track(of === "backward" ? "backward" : "forward");
    },
    track_again: () => send({ type: "calibration_check", action: "track_again" }),
  };
  return (action) => table[action.deed](action);
}
