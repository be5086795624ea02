/** Splitter between panes and 3-D view, moved by pointer or arrow keys and reset by a double-click. Its position is stored. */

const STORED = "quadrille.panes-fraction";
const DEFAULT_FRACTION = 0.62;
const MIN_PANES_PX = 480;
const MIN_SCENE_PX = 300;
const KEY_STEP_PX = 24;

/**
 * @param {HTMLElement} workspace
 * @param {HTMLElement} bar
 * @param {HTMLElement} column beside the 3-D view, whose width is taken from the 3-D view first
 */
export function makeSplitter(workspace, bar, column) {
  let fraction = Number(localStorage.getItem(STORED)) || DEFAULT_FRACTION;

  const show = () => {
    const width = workspace.clientWidth;
    const max = width - column.offsetWidth - MIN_SCENE_PX;
    const panes = Math.round(Math.max(Math.min(MIN_PANES_PX, max), Math.min(max, fraction * width)));
    workspace.style.setProperty("--panes-width", `${panes}px`);
    bar.setAttribute("aria-valuenow", String(Math.round((100 * panes) / Math.max(1, width))));
    return panes;
  };
  const moveTo = (/** @type {number} */ x) => {
    fraction = x / workspace.clientWidth;
    fraction = show() / workspace.clientWidth;
    localStorage.setItem(STORED, String(fraction));
  };

  bar.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    bar.setPointerCapture(event.pointerId);
    workspace.classList.add("is-splitting");
  });
  bar.addEventListener("pointermove", (event) => {
    if (bar.hasPointerCapture(event.pointerId)) moveTo(event.clientX - workspace.getBoundingClientRect().left);
  });
  bar.addEventListener("lostpointercapture", () => workspace.classList.remove("is-splitting"));
  bar.addEventListener("dblclick", () => moveTo(DEFAULT_FRACTION * workspace.clientWidth));
  bar.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: -KEY_STEP_PX, ArrowRight: KEY_STEP_PX }[event.key];
    if (step === undefined) return;
    event.preventDefault();
    moveTo(show() + step);
  });
  const sizes = new ResizeObserver(show);
  sizes.observe(workspace);
  sizes.observe(column);
}
