/**
 * Dialog that makes a session of videos and a calibration. It shows the cameras before anything is made; the program's
 * checks are listed as they pass.
 */

import { button, byId, make, onSubmit } from "../widgets/elements.js";
import { makeCameraCards } from "./camera_cards.js";
import { DialogForm } from "./dialog_form.js";
import { drawRig } from "./rig_drawing.js";
import { postJson } from "../widgets/post_json.js";
import { sentence } from "../widgets/text.js";

/**
 * @typedef {{cameras: [string, string], with_backgrounds: boolean, text: string}} Exchanged
 * @typedef {{passed?: string, warning?: string, failed?: string, exchanged?: Exchanged, made?: string}} Line
 * @typedef {{cameras: string[], footage: import("./camera_cards.js").Footage[], assigned: Record<string, string>,
 *   rig: import("./rig_drawing.js").Rig | null, beside: Record<string, string>, problems: string[]}} Survey
 */

/** Wait for a pause in typing before the files are looked at. */
const PAUSE_MS = 250;
/** Fields on which the survey depends. */
const SURVEYED = ["footage", "calibration", "up", "units", "poses"];

export class NewSession extends DialogForm {
  #make = byId("make-session", HTMLButtonElement);
  #openIt = byId("open-made-session", HTMLButtonElement);
  #rig = byId("rig", HTMLElement);
  #cards;
  /** Folder of the session that was made; empty before. */
  #made = "";
  /** Footage and calibration of the cards. */
  #surveyed = "";
  #nSurveys = 0;
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  #timer;

  /**
   * @param {import("./path_picker.js").PathPicker} picker
   * @param {(folder: string) => void} open opens a session
   */
  constructor(picker, open) {
    super("new-session", picker);
    this.#cards = makeCameraCards(
      () => this.#begin(),
      (from, take) => picker.show("footage", from || this.value("footage"), take),
    );
    onSubmit(this.form, () => void this.#run(false));
    this.form.addEventListener("input", (event) => this.#onInput(event.target));
    button("cancel-new-session", () => this.dialog.close());
    this.#openIt.addEventListener("click", () => {
      this.dialog.close();
      open(this.#made);
    });
  }

  show() {
    this.dialog.showModal();
    this.#begin();
    void this.#fillModels();
    void this.#survey();
  }

  async #fillModels() {
    const answer = await fetch("sessions/models").catch(() => null);
    if (!answer?.ok) return;
    const { models, default: usual } = await answer.json();
    byId("new-models", HTMLDataListElement).replaceChildren(...models.map((/** @type {string} */ name) => new Option("", name)));
    byId("new-model", HTMLInputElement).placeholder = usual;
  }

  /**
   * Show the form with a calibration that this program has written.
   *
   * @param {string} calibration its file
   * @param {string} up axis that points up
   */
  showWith(calibration, up) {
    if (!this.dialog.open) this.show();
    this.field("up").value = up;
    this.field("poses").value = "world-to-camera";
    this.field("calibration").value = calibration;
    this.field("calibration").dispatchEvent(new Event("input", { bubbles: true }));
  }

  /** @param {EventTarget | null} target */
  #onInput(target) {
    const name = target instanceof HTMLInputElement || target instanceof HTMLSelectElement ? target.name : "";
    if (!name) return; // a card
    this.#begin();
    if (!SURVEYED.includes(name)) return;
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => void this.#survey(), PAUSE_MS);
  }

  /** Look at footage and calibration, and show the cameras. */
  async #survey() {
    const [footage, calibration] = [this.value("footage"), this.value("calibration")];
    const number = ++this.#nSurveys;
    /** @type {Survey} */
    let found = { cameras: [], footage: [], assigned: {}, rig: null, beside: {}, problems: [] };
    if (footage || calibration) {
      const [up, units, poses] = ["up", "units", "poses"].map((name) => this.value(name) || null);
      const chosen = calibration === this.proposed.calibration ? null : calibration || null;
      const form = { footage: footage || null, calibration: chosen, up, units, poses };
      try {
        await postJson("sessions/survey", form, (line) => (found = JSON.parse(line)));
      } catch (error) {
        found.problems.push(error instanceof Error ? error.message : String(error));
      }
    }
    if (number !== this.#nSurveys) return;
    if (found.footage.length) {
      const folder = `${footage.replace(/\/+$/, "")}_session`;
      Object.entries({ folder, calibration: "", background: "", masks: "", ...found.beside }).forEach(([name, value]) => this.propose(name, value));
    }
    this.#cards.show(found.cameras, found.footage, found.assigned, this.#files === this.#surveyed);
    this.#surveyed = this.#files;
    this.#showRig(found.rig);
    if (!this.checks.children.length) found.problems.forEach((problem) => this.add("is-failed", problem));
  }

  /** @param {Survey["rig"]} rig */
  #showRig(rig) {
    this.#rig.hidden = rig === null;
    if (!rig) return;
    const [top, side] = this.#rig.querySelectorAll("svg");
    drawRig(top, side, rig, this.value("up"));
    const doubts = rig.doubts.map((doubt) => make("p", "is-warning", doubt));
    byId("rig-text", HTMLElement).replaceChildren(make("p", {}, rig.sentence), ...doubts);
  }

  /** Forget the outcome of the last attempt. */
  #begin() {
    this.#made = "";
    this.#showButtons();
    this.checks.replaceChildren();
  }

  /** @param {boolean} keepsAssignment whether the footage stays as assigned even if cameras seem exchanged */
  async #run(keepsAssignment) {
    this.#begin();
    this.#make.disabled = true;
    clearTimeout(this.#timer);
    if (this.#files !== this.#surveyed) await this.#survey(); // else the cameras would be those of other files
    this.#begin();
    await this.post("sessions/new", this.#request(keepsAssignment), (line) => this.#showLine(line));
    this.#make.disabled = false;
    this.#showButtons();
    if (this.#made) this.#openIt.focus();
  }

  /** Show *Open* alone when the session is made. */
  #showButtons() {
    for (const part of /** @type {Iterable<HTMLElement>} */ (this.#openIt.parentElement?.children)) {
      part.hidden = (part === this.#openIt) !== (this.#made !== "");
    }
  }

  /** @param {boolean} keepsAssignment */
  #request(keepsAssignment) {
    const optional = (/** @type {string} */ name) => this.value(name) || null;
    return {
      folder: this.value("folder"),
      calibration: this.value("calibration"),
      footage: this.value("footage"),
      cameras: this.#cards.chosen(),
      people: this.list("people"),
      heights: this.list("heights").map(Number),
      models: this.list("models"),
      up: this.value("up"),
      units: optional("units"),
      poses: optional("poses"),
      rescale: this.field("rescale").checked,
      common_frames: this.field("common_frames").checked,
      fps: this.number("fps"),
      background: optional("background"),
      masks: optional("masks"),
      keep_assignment: keepsAssignment,
    };
  }

  /** @param {Line} line */
  #showLine({ passed, warning, failed, exchanged, made }) {
    if (passed) this.add("is-passed", passed);
    if (warning) this.add("is-warning", warning);
    if (failed) this.add("is-failed", failed);
    if (exchanged) this.#offerExchange(exchanged);
    if (!made) return;
    this.#made = made;
    this.add("is-passed", `The session is in ${made}.`);
  }

  /** @param {Exchanged} exchanged */
  #offerExchange({ cameras: [first, second], with_backgrounds: withSide, text }) {
    const item = this.add("is-warning", `${sentence(text)} Nothing has been made yet.`);
    const offer = (/** @type {string} */ label, /** @type {string} */ title, /** @type {() => void} */ run) => {
      const choice = make("button", { type: "button", title, onclick: run }, label);
      item.append(choice);
      return choice;
    };
    const exchange = offer("Exchange these two", `Give the footage of ${first} to ${second} and the other way round, then check again`, () => {
      this.#cards.exchange(first, second, withSide);
      void this.#run(false);
    });
    exchange.className = "is-primary";
    offer("Keep as they are", "Make the session with the footage as it is", () => void this.#run(true));
    item.scrollIntoView({ block: "nearest" });
    exchange.focus();
  }

  /** Footage and calibration in one text. */
  get #files() {
    return JSON.stringify([this.value("footage"), this.value("calibration")]);
  }
}
