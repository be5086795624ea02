/** Pieces that sections share: work that goes on, long lists of frames, and commands of the palette. */

import { make, textButton } from "../widgets/elements.js";
import { count, displayName } from "../widgets/text.js";

/** @param {HTMLElement[]} children in one line */
export function group(...children) {
  return make("div", "acquisition-work", ...children);
}

/**
 * Make a bar and a button to stop for work while it goes on, and the line that says how far it is or how it ended.
 *
 * @param {string} title of the button
 * @param {() => void} stop
 * @param {import("../widgets/elements.js").Properties<"p">} [announced] how screen readers hear the line
 */
export function workRow(title, stop, announced = { role: "status" }) {
  const progress = make("progress");
  const element = group(progress, textButton("Stop", title, stop));
  const status = make("p", { className: "section-note", ...announced });
  return {
    element,
    progress,
    status,
    /**
     * @param {{running: boolean, share: number, stage: string, message: string, failed?: boolean} | null} work
     * @param {string} [text]
     */
    show(work, text = !work ? "" : work.running ? `${work.stage} …` : work.message) {
      element.hidden = !work?.running;
      progress.value = work?.share ?? 0;
      status.textContent = text;
      status.hidden = !text;
      status.classList.toggle("is-failed", work?.failed ?? false);
    },
  };
}

/**
 * Make an entry of a list that goes to a frame.
 *
 * @param {number} frame
 * @param {boolean} isHere
 * @param {string} title
 * @param {() => void} visit
 * @param {HTMLElement[]} cells
 */
export function frameRow(frame, isHere, title, visit, ...cells) {
  const go = textButton("", title, visit, { className: "frame-row", "data-no-command": "", ...(isHere ? { "aria-current": "true" } : {}) });
  go.append(make("span", "observed-frame", String(frame)), ...cells);
  return make("li", {}, go);
}

/**
 * Make a row of a joint of a person on a frame.
 *
 * @param {readonly {name: string}[]} people of the session, of whom the person is named if there are several
 * @param {{frame: number, person: number, joint: string}} at
 * @param {boolean} isHere
 * @param {() => void} visit
 * @param {[text: string, figure: string]} cells
 */
export function jointRow(people, { frame, person, joint }, isHere, visit, [text, figure]) {
  const who = people.length > 1 ? `${people[person]?.name}, ` : "";
  const title = `Go to frame ${frame} and select the ${displayName(joint)}`;
  return frameRow(frame, isHere, title, visit, make("span", {}, who + text), make("span", "quiet", figure));
}

/**
 * Show the first entries of a list, and the others after a button.
 *
 * @template Entry
 * @param {HTMLElement} list
 * @param {number} few number of the first entries
 * @param {string} title of the button
 * @param {(entry: Entry, rank: number) => HTMLElement} row
 */
export function longList(list, few, title, row) {
  let limit = few;
  /** @type {Entry[]} */
  let entries = [];
  const draw = () => {
    list.replaceChildren(...entries.slice(0, limit).map(row));
    list.hidden = entries.length === 0;
    more.hidden = entries.length <= limit;
    more.textContent = `${count(entries.length - limit)} more`;
  };
  const more = textButton("More", title, () => {
    limit = Infinity;
    draw();
  });
  return {
    elements: [list, more],
    /**
     * @param {Entry[]} all
     * @param {boolean} [isNew] whether to begin with the first entries again
     * @param {number} [reached] rank of an entry that has to be shown
     */
    show(all, isNew = false, reached = 0) {
      entries = all;
      limit = isNew ? few : reached >= limit ? Infinity : limit;
      draw();
    },
  };
}

/**
 * Make a field of a form with its name before it.
 *
 * @param {string} kind class
 * @param {string} text
 * @param {string} title
 * @param {HTMLElement} field
 */
export function labelled(kind, text, title, field) {
  return make("label", { className: kind, title }, make("span", {}, text), field);
}
