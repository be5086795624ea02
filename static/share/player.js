/** The shown frame and layers, and what follows when they change. */

import { data } from "./data.js";

/** @type {{ at: number, isPlaying: boolean, contours: boolean, bones: boolean, only: number | null }} */
const state = { at: 0, isPlaying: false, contours: true, bones: false, only: null };

/** @type {(() => void)[]} */
const followers = [];
let isDue = false;
let startedAt = 0;
let startedFrom = 0;

/** The present state; `only` is the one view that is shown, or null. */
export const shown = () => state;

/**
 * Call a function at the next animation frame after each change.
 *
 * @param {() => void} draw
 */
export const follow = (draw) => {
  followers.push(draw);
};

/** Draw everything at the next animation frame. */
export const redraw = () => {
  if (isDue) return;
  isDue = true;
  requestAnimationFrame(() => {
    isDue = false;
    for (const draw of followers) draw();
  });
};

/**
 * Change some of the state.
 *
 * @param {Partial<typeof state>} changes
 */
export const change = (changes) => {
  Object.assign(state, changes);
  redraw();
};

/**
 * Show a frame, the nearest one that exists.
 *
 * @param {number} at index into the frames
 */
export const seek = (at) => {
  const next = Math.max(0, Math.min(data.frames.length - 1, Math.round(at)));
  if (next !== state.at) change({ at: next });
  startFrom(next);
};

/** Start playing, from the beginning if the last frame is shown; or stop. */
export const togglePlay = () => {
  const isPlaying = !state.isPlaying;
  if (isPlaying && state.at === data.frames.length - 1) state.at = 0;
  change({ isPlaying });
  startFrom(state.at);
  if (isPlaying) requestAnimationFrame(advance);
};

/** @param {number} at */
const startFrom = (at) => {
  startedAt = performance.now();
  startedFrom = data.frames[at];
};

/** Show the frame whose time has come; frames that are late are left out. */
const advance = () => {
  if (!state.isPlaying) return;
  const frame = startedFrom + ((performance.now() - startedAt) / 1000) * data.fps;
  let at = state.at;
  while (at + 1 < data.frames.length && data.frames[at + 1] <= frame) at += 1;
  const isOver = at === data.frames.length - 1;
  if (at !== state.at || isOver) change({ at, isPlaying: !isOver });
  if (!isOver) requestAnimationFrame(advance);
};
