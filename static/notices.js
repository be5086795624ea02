/** What the program has to say: sentences that pass, errors that wait to be read, and the banner while it is away. */

const INFO_MS = 5000;
const ERROR_MS = 20000;
const MOST_SHOWN = 4;

/**
 * @param {HTMLElement} list
 * @param {import("./protocol.js").NoticeMessage} notice
 */
export function showNotice(list, { level, text }) {
  // The same sentence again (a key held down, say) takes the place of the first.
  for (const shown of list.querySelectorAll("[role]")) {
    if (shown.querySelector("span")?.textContent === text) shown.remove();
  }
  const element = document.createElement("div");
  element.className = `notice is-${level}`;
  element.setAttribute("role", level === "error" ? "alert" : "status");
  const sentence = document.createElement("span");
  sentence.textContent = text;
  const close = document.createElement("button");
  close.type = "button";
  close.textContent = "×";
  close.setAttribute("aria-label", "Dismiss");
  close.title = "Dismiss";
  close.addEventListener("click", () => element.remove());
  element.append(sentence, close);
  list.append(element);
  while (list.childElementCount > MOST_SHOWN) list.firstElementChild?.remove();
  setTimeout(() => element.remove(), level === "error" ? ERROR_MS : INFO_MS);
}

/**
 * @param {HTMLElement} banner
 * @param {import("./store.js").Store} store
 */
export function watchConnection(banner, store) {
  const show = () => {
    const { connected, session } = store.facts;
    banner.textContent = session ? "Connection lost. Reconnecting…" : "Connecting…";
    banner.classList.toggle("is-shown", !connected);
    document.body.classList.toggle("is-cut-off", !connected);
  };
  store.subscribe((changed) => {
    if (changed.has("connected") || changed.has("session")) show();
  });
  show();
}
