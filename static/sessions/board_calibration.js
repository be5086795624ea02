/** Dialog that calibrates cameras by footage of a board: the corners that were found, the expected error, and doubts. */

import { button, byId, make, makeSvg, onSubmit } from "../widgets/elements.js";
import { DialogForm } from "./dialog_form.js";
import { previewOf } from "./path_picker.js";

/**
 * @typedef {object} Calibrated
 * @property {string} out file of the calibration
 * @property {string} up axis of its world that points up
 * @property {string} sentence expected error
 * @property {string[]} doubts
 * @property {Seen[]} cameras
 *
 * @typedef {object} Seen corners of the board in the pictures of a camera
 * @property {string} name
 * @property {string} footage its path
 * @property {[number, number]} size of its pictures, px
 * @property {number} views number of pictures with corners
 * @property {number} covered_share of the picture, 0 to 1
 * @property {number | null} held_out_px reprojection error on frames that were left out
 * @property {number[]} corners x and y in turn, px
 * @property {number[]} gross the same of corners that are far off
 *
 * @typedef {{progress?: {share: number, text: string}, failed?: string, calibrated?: Calibrated}} Line
 */

const NOTE = "The pictures of the cameras appear here, with the corners that are found in all frames.";
const LEGEND = "Corners in all frames, over the first one. Those in red are far off their place, and count little.";

export class BoardCalibration extends DialogForm {
  #stop = byId("stop-calibration", HTMLButtonElement);
  #calibrate = byId("calibrate", HTMLButtonElement);
  #useIt = byId("use-calibration", HTMLButtonElement);
  #fields = byId("board-fields", HTMLElement);
  #stage = byId("board-stage", HTMLElement);
  #share = byId("board-share", HTMLProgressElement);
  #cameras = byId("board-cameras", HTMLElement);
  #note = byId("board-cameras-note", HTMLElement);
  /** Ends the work that runs; null if none does. @type {AbortController | null} */
  #work = null;
  /** @type {Calibrated | null} */
  #found = null;

  /**
   * @param {import("./path_picker.js").PathPicker} picker
   * @param {(out: string, up: string) => void} use takes a calibration, and the axis that points up
   */
  constructor(picker, use) {
    super("board-calibration", picker);
    onSubmit(this.form, () => void this.#run());
    this.form.addEventListener("input", () => {
      this.propose("out", this.value("footage") && `${this.value("footage").replace(/\/+$/, "")}/calibration.toml`);
      this.#begin();
    });
    const stop = () => this.#work?.abort(new Error("Stopped: nothing was written."));
    this.dialog.addEventListener("close", stop);
    this.#stop.addEventListener("click", stop);
    button("close-board-calibration", () => this.dialog.close());
    this.#useIt.addEventListener("click", () => {
      this.dialog.close();
      if (this.#found) use(this.#found.out, this.#found.up);
    });
  }

  show() {
    this.dialog.showModal();
    this.#begin();
    void this.#fillDictionaries();
  }

  async #fillDictionaries() {
    const answer = await fetch("sessions/models").catch(() => null);
    const menu = byId("board-dictionary", HTMLSelectElement);
    if (!answer?.ok || menu.length > 1) return;
    menu.append(...(await answer.json()).dictionaries.map((/** @type {string} */ name) => new Option(name)));
  }

  /** Forget the result of other fields. */
  #begin() {
    this.#found = null;
    this.checks.replaceChildren();
    this.#cameras.replaceChildren();
    this.#note.textContent = NOTE;
    this.#showState();
  }

  #showState() {
    const [isBusy, isDone] = [this.#work !== null, this.#found !== null];
    this.#fields.inert = isBusy;
    this.#stop.hidden = this.#share.hidden = !isBusy;
    this.#useIt.hidden = !isDone;
    this.#calibrate.hidden = isBusy || isDone;
    if (!isBusy) this.#stage.textContent = isDone ? "" : "Nothing is written before the end, and no file is replaced.";
    for (const input of /** @type {NodeListOf<HTMLInputElement>} */ (this.form.querySelectorAll("[data-describes]"))) {
      input.disabled = this.value("board") !== "" || !["", this.value("kind")].includes(input.dataset.describes ?? "");
    }
  }

  async #run() {
    this.#work = new AbortController();
    this.#begin();
    this.#share.removeAttribute("value");
    this.#stage.textContent = "Opening the footage";
    const { signal } = this.#work;
    await this.post("sessions/calibrate", this.#request(), (line) => this.#showLine(line), signal);
    this.#work = null;
    this.#showState();
    if (this.#found) this.#useIt.focus();
  }

  #request() {
    return {
      footage: this.value("footage"),
      board: this.value("board") || this.#description(),
      out: this.value("out"),
      fisheye: this.list("fisheye"),
      offsets: Object.fromEntries(this.list("offsets").map((one) => [one.split("=")[0].trim(), Number(one.split("=")[1])])),
      common_frames: this.field("common_frames").checked,
      floor_frame: this.number("floor_frame"),
    };
  }

  /** The board, as in its file. */
  #description() {
    const inputs = /** @type {NodeListOf<HTMLInputElement>} */ (this.form.querySelectorAll("[data-describes]:enabled"));
    const isGiven = [...inputs].filter(({ type, value }) => type === "checkbox" || value);
    return Object.fromEntries(isGiven.map(({ name, type, value, checked }) => [name, type === "checkbox" ? checked : type === "number" ? Number(value) : value]));
  }

  /** @param {Line} line */
  #showLine({ progress, failed, calibrated }) {
    if (progress) {
      this.#share.value = progress.share;
      this.#stage.textContent = progress.text;
    }
    if (failed) this.add("is-failed", failed);
    if (!calibrated) return;
    this.#found = calibrated;
    this.add("is-passed", calibrated.sentence);
    this.add("is-passed", `The calibration is in ${calibrated.out}.`);
    calibrated.doubts.forEach((doubt) => this.add("is-warning", doubt));
    this.#cameras.replaceChildren(...calibrated.cameras.map(card));
    this.#note.textContent = LEGEND;
  }
}

/** @param {Seen} camera */
function card({ name, footage, size: [width, height], views, covered_share: share, held_out_px: error, corners, gross }) {
  const picture = makeSvg(
    "svg",
    { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": `Corners found by ${name}` },
    makeSvg("image", { href: previewOf(footage), width, height }),
    makeSvg("path", { d: dots(corners), class: "corners" }),
    makeSvg("path", { d: dots(gross), class: "corners is-gross" }),
  );
  const quality = error === null ? "no frame left out" : `${error.toFixed(2)} px off`;
  const text = `${views} views, ${Math.round(100 * share)}% covered, ${quality}`;
  const title = "Pictures with corners; share of the picture that lay between corners; reprojection error on frames that were left out of a first adjustment";
  return make("li", { title }, picture, make("b", "is-clipped", name), make("span", {}, text));
}

/** @param {number[]} flat x and y in turn */
function dots(flat) {
  return flat.map((value, i) => (i % 2 ? `${value}h0` : `M${value} `)).join("");
}
