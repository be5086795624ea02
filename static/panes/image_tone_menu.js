/** Popover for brightness, contrast and gamma of a camera's image. */

import { byId, make } from "../widgets/elements.js";
import { PLAIN, isPlain } from "../model/image_tone.js";
import { slider, togglePopover } from "../widgets/popovers.js";

const signed = (/** @type {number} */ value) => (value > 0 ? `+${value}` : String(value));
/** The gamma slider is logarithmic and symmetric about 1. */
const GAMMA_STEPS = 100;
const MAX_GAMMA = 5;

export class ImageToneMenu {
  #store;
  #imageTones;
  #panel = byId("image-tone-menu", HTMLElement);
  #title = make("h3");
  #camera = 0;
  #closedAt = -Infinity;
  /** @type {(() => void)[]} */
  #show = [];

  /**
   * @param {import("../model/store.js").Store} store
   * @param {import("../model/image_tone.js").ImageTones} imageTones
   */
  constructor(store, imageTones) {
    this.#store = store;
    this.#imageTones = imageTones;
    this.#panel.append(this.#title);
    this.#row("Brightness", "Offset of all gray levels", "brightness");
    this.#row("Contrast", "Spread of the gray levels around the middle", "contrast");
    this.#row("Gamma", "Above 1 brightens shadows, below 1 darkens them", "gamma");
    this.#buildFoot();
    this.#panel.addEventListener("toggle", () => {
      if (!this.#panel.matches(":popover-open")) this.#closedAt = performance.now();
    });
    store.on(["imageTones"], () => this.#show.forEach((one) => one()));
  }

  /**
   * Open the popover for a camera at a button, or close it if it is open for that camera.
   *
   * @param {number} camera
   * @param {HTMLElement} button
   */
  toggle(camera, button) {
    // The press on the button has already closed the popover: this click must not open it again.
    if (camera === this.#camera && performance.now() - this.#closedAt < 250) return;
    if (this.#panel.matches(":popover-open") && camera !== this.#camera) this.#panel.hidePopover();
    this.#camera = camera;
    this.#title.textContent = this.#store.facts.session?.cameras[camera].name ?? "";
    this.#show.forEach((one) => one());
    togglePopover(this.#panel, button);
  }

  get #tone() {
    return this.#store.facts.imageTones[this.#camera] ?? PLAIN;
  }

  /**
   * @param {string} label
   * @param {string} title
   * @param {keyof import("../model/image_tone.js").ImageTone} field
   */
  #row(label, title, field) {
    const isGamma = field === "gamma";
    const caption = make("span", { title }, label);
    const control = slider({
      label,
      title,
      min: -100,
      max: 100,
      step: 2,
      format: (value) => (isGamma ? gammaOf(value).toFixed(2) : signed(value)),
      onInput: (value) =>
        this.#imageTones.set(this.#camera, { ...this.#tone, [field]: isGamma ? gammaOf(value) : value }),
    });
    control.input.dataset.tone = field;
    this.#show.push(() => {
      const value = this.#tone[field];
      control.show(isGamma ? Math.round((GAMMA_STEPS * Math.log(value)) / Math.log(MAX_GAMMA)) : value);
    });
    this.#panel.append(caption, control.input, control.value);
  }

  #buildFoot() {
    const all = make("button", { type: "button", title: "Apply these settings to all cameras", onclick: () => this.#imageTones.setAll(this.#tone) }, "All cameras");
    const reset = make("button", { type: "button", title: "Show the original image", onclick: () => this.#imageTones.set(this.#camera, PLAIN) }, "Reset");
    this.#show.push(() => (reset.disabled = isPlain(this.#tone)));
    this.#panel.append(make("div", "popover-foot", all, reset));
  }
}

/** @param {number} step -100 to 100 */
function gammaOf(step) {
  return MAX_GAMMA ** (step / GAMMA_STEPS);
}
