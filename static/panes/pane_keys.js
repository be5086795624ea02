/** Keys of the camera panes and their layers. */

import { command, inArea } from "../widgets/key_matching.js";

/**
 * @param {{store: import("../model/store.js").Store, grid: import("./pane_grid.js").PaneGrid, gestures: import("./gestures.js").Gestures,
 *   layersMenu: import("./layers_menu.js").LayersMenu, say: (text: string) => void}} parts
 */
export function paneBindings({ store, grid, gestures, layersMenu, say }) {
  return inArea("Views", [
    { keys: ["A"], label: "Layers", run: () => layersMenu.toggle() },
    { label: "Brightness and contrast of a pane", run: () => grid.openToneMenu() },
    {
      keys: ["1 – 9", "0"],
      label: "Fill the grid with a camera (toggle, two digits for 10 to 16), 0: show the whole image",
      matches: (event) => /^\d$/.test(event.key) && !event.ctrlKey && !event.metaKey && !event.altKey,
      run: ({ key }) => grid.typeCamera(Number(key)) || key !== "0" || grid.resetViews(),
    },
    { label: "Show the whole image", run: () => grid.resetViews() },
    { label: "Fill the grid with the next camera", run: () => grid.stepFill(1) },
    { label: "Fill the grid with the previous camera", run: () => grid.stepFill(-1) },
    { label: "Zoom all views to the people", run: () => grid.framePeople() },
    { label: "Link the zoom of all views (toggle)", run: () => grid.toggleLink() },
    {
      keys: ["`"],
      label: "Bare picture: hide all drawing while the key is held",
      words: "hide show nothing overlay contours joints",
      // The palette has no key to hold: there it is a toggle.
      run: ({ code }) => store.set({ bare: code !== "" || !store.facts.bare }),
      release: () => store.set({ bare: false }),
    },
    command("Zoomed views follow the people from frame to frame (toggle)", "pan track playback steady still", () =>
      say(`Zoomed views ${grid.togglePeopleFollowed() ? "follow the people." : "stay where they are."}`),
    ),
    command("Reset the sizes of all panes", "resize border split automatic", () => grid.resetSizes(), () =>
      grid.isResized ? null : "No pane was resized. Drag a border between two panes to do so.",
    ),
    { label: "Take the next of the joints that overlap under the pointer", run: () => gestures.offerNext() },
  ]);
}
