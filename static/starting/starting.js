/** Show what the program is doing until it serves the session's page, then load that. */

const POLL_MS = 60;
const ENDED = "The program does not answer. If it has ended, its terminal says why.";

const steps = /** @type {HTMLElement} */ (document.querySelector("#steps"));
const note = /** @type {HTMLElement} */ (document.querySelector("#note"));

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

/** Fetch the files of the session's page, which the browser keeps: the page then opens without waiting for them. */
async function fetchAhead() {
  try {
    const answer = await fetch("page-files.json", { cache: "no-store" });
    for (const address of answer.ok ? await answer.json() : []) fetch(address).catch(() => {});
  } catch {
    // The page fetches them itself.
  }
}

async function look() {
  try {
    const answer = await fetch("starting.json", { cache: "no-store" });
    const progress = answer.ok ? await answer.json() : null;
    // No step is left once the session's page is served. It may refuse to answer without its token.
    if (!progress?.steps.length) return location.reload();
    show(progress);
  } catch {
    note.textContent = ENDED;
  }
  setTimeout(look, POLL_MS);
}

look();
fetchAhead();
