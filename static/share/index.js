/** The shared page: mount its parts, buttons and keys. */

import { mountCurves } from "./curves.js";
import { data } from "./data.js";
import { mountDetails } from "./details.js";
import { byId } from "./dom.js";
import { change, follow, redraw, seek, shown, togglePlay } from "./player.js";
import { mountScene } from "./scene.js";
import { mountTimeline } from "./timeline.js";
import { mountViews, toggleOnly } from "./views.js";

const root = document.documentElement;

/** Go to the other colour scheme. */
const toggleTheme = () => {
  root.dataset.theme = root.dataset.theme === "light" ? "dark" : "light";
  redraw();
};

/** @type {Record<string, () => void>} */
const KEYS = {
  ArrowLeft: () => seek(shown().at - 1),
  ArrowRight: () => seek(shown().at + 1),
  PageUp: () => seek(shown().at - 10),
  PageDown: () => seek(shown().at + 10),
  Home: () => seek(0),
  End: () => seek(data.frames.length - 1),
  " ": togglePlay,
  c: () => change({ contours: !shown().contours }),
  b: () => change({ bones: !shown().bones }),
  d: toggleTheme,
};

/** @type {Record<string, string>} */
const BUTTONS = { back: "ArrowLeft", on: "ArrowRight", play: " ", contours: "c", bones: "b", theme: "d" };

/** @param {KeyboardEvent} event */
const press = (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const target = /** @type {HTMLElement} */ (event.target);
  if (target.tagName === "SELECT") return;
  const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
  const act = KEYS[key] ?? (/^[1-9]$/.test(key) ? () => toggleOnly(Number(key) - 1) : null);
  if (!act) return;
  event.preventDefault();
  act();
};

const drawBars = () => {
  const { at, isPlaying, contours, bones } = shown();
  byId("frame").textContent = `frame ${data.frames[at]}`;
  byId("play").textContent = isPlaying ? "Pause" : "Play";
  for (const [id, isOn] of Object.entries({ play: isPlaying, contours, bones })) {
    byId(id).setAttribute("aria-pressed", String(isOn));
  }
};

root.dataset.theme = matchMedia("(prefers-color-scheme: light)").matches ? "light" : "dark";
document.title = `${data.session}, shared by Quadrille`;
byId("session").textContent = data.session;
const [first, last] = [data.frames[0], data.frames[data.frames.length - 1]];
byId("stretch").textContent = `frames ${first} to ${last}, ${data.fps} per second; ${data.calibration}; read only`;
for (const [id, key] of Object.entries(BUTTONS)) byId(id).onclick = KEYS[key];
addEventListener("keydown", press);
addEventListener("resize", redraw);
mountViews();
mountScene();
mountCurves();
mountTimeline();
mountDetails();
follow(drawBars);
redraw();
