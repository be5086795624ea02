/** Show what the program is doing while it starts. Runs before the other modules are loaded. */

const POLL_MS = 60;
const ENDED = "The program does not answer. If it has ended, its terminal says why.";

const root = document.documentElement;
const steps = /** @type {HTMLElement} */ (document.querySelector("#steps"));
const note = /** @type {HTMLElement} */ (document.querySelector("#start-note"));

/** @param {{steps: string[], at: number}} progress */
function show({ steps: names, at }) {
  note.textContent = "";
  steps.replaceChildren(
    ...names.map((name, i) => {
      const item = document.createElement("li");
      item.textContent = name;
      item.classList.toggle("is-done", i < at);
      if (i === at) item.setAttribute("aria-current", "step");
      return item;
    }),
  );
}

/** Return whether the program has started. It may refuse to answer without its token. */
async function hasStarted() {
  const answer = await fetch("starting.json", { cache: "no-store" });
  const progress = answer.ok ? await answer.json() : null;
  if (!progress?.steps.length) return true;
  show(progress);
  return false;
}

/**
 * Let the program exchange the token in the address for a cookie and the page's own address, to which the cookie is
 * bound. If it refuses the page, show its refusal.
 */
async function enter() {
  const answer = await fetch(location.href, { cache: "no-store" });
  if (answer.ok) {
    const root = answer.headers.get("Content-Location");
    if (root !== null) history.replaceState(null, "", root);
    return;
  }
  location.reload();
  await new Promise(() => {});
}

async function untilStarted() {
  for (;;) {
    try {
      if (await hasStarted()) {
        await enter();
        delete root.dataset.starting;
        return;
      }
    } catch {
      note.textContent = ENDED;
    }
    await new Promise((resolve) => setTimeout(resolve, POLL_MS));
  }
}

const isStarting = "starting" in root.dataset;
if (isStarting) {
  // The process that sends the main module ends when the program answers, perhaps before all is sent.
  document.querySelector('script[src$="/main.js"]')?.addEventListener("error", () => location.reload());
}

/** Resolved once the program serves the page's session. */
export const started = isStarting ? untilStarted() : Promise.resolve();
