/** Popover for brightness, contrast and gamma of a camera's image. */

import { byId, make } from "../widgets/elements.js";
import { PLAIN, isPlain } from "../model/image_tone.js";
import { slider, togglePopover } from "../widgets/popovers.js";

const signed = (/** @type {number} */ value) => (value > 0 ? `+${value}` : String(value));
/** The gamma slider is logarithmic and symmetric about 1. */
const GAMMA_STEPS = 100;
const MAX_GAMMA = 5;

/**
 * @param {import("../model/store.js").Store} store
 * @param {import("../model/image_tone.js").ImageTones} imageTones
 */
export function mountImageToneMenu(store, imageTones) {
  const panel = byId("image-tone-menu", HTMLElement);
  const title = make("h3");
  let shownCamera = 0;
  let closedAt = -Infinity;
  /** @type {(() => void)[]} */
  const show = [];
  panel.append(title);
  row("Brightness", "Offset of all gray levels", "brightness");
  row("Contrast", "Spread of the gray levels around the middle", "contrast");
  row("Gamma", "Above 1 brightens shadows, below 1 darkens them", "gamma");
  buildFoot();
  panel.addEventListener("toggle", () => {
    if (!panel.matches(":popover-open")) closedAt = performance.now();
  });
  store.on(["imageTones"], () => show.forEach((one) => one()));

  /**
   * Open the popover for a camera at a button, or close it if it is open for that camera.
   *
   * @param {number} camera
   * @param {HTMLElement} button
   */
  function toggle(camera, button) {
    // The press on the button has already closed the popover: this click must not open it again.
    if (camera === shownCamera && performance.now() - closedAt < 250) return;
    if (panel.matches(":popover-open") && camera !== shownCamera) panel.hidePopover();
    shownCamera = camera;
    title.textContent = store.facts.session?.cameras[camera].name ?? "";
    show.forEach((one) => one());
    togglePopover(panel, button);
  }

  function getTone() {
    return store.facts.imageTones[shownCamera] ?? PLAIN;
  }

  /**
   * @param {string} label
   * @param {string} title
   * @param {keyof import("../model/image_tone.js").ImageTone} field
   */
  function row(label, title, field) {
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
        imageTones.set(shownCamera, { ...getTone(), [field]: isGamma ? gammaOf(value) : value }),
    });
    control.input.dataset.tone = field;
    show.push(() => {
      const value = getTone()[field];
      control.show(isGamma ? Math.round((GAMMA_STEPS * Math.log(value)) / Math.log(MAX_GAMMA)) : value);
    });
    panel.append(caption, control.input, control.value);
  }

  function buildFoot() {
    const all = make("button", { type: "button", title: "Apply these settings to all cameras", onclick: () => imageTones.setAll(getTone()) }, "All cameras");
    const reset = make("button", { type: "button", title: "Show the original image", onclick: () => imageTones.set(shownCamera, PLAIN) }, "Reset");
    show.push(() => (reset.disabled = isPlain(getTone())));
    panel.append(make("div", "popover-foot", all, reset));
  }

  return { toggle };
}

/** @param {number} step -100 to 100 */
function gammaOf(step) {
  return MAX_GAMMA ** (step / GAMMA_STEPS);
}
