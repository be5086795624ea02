/** Keys of the camera panes and their layers. */

import { BY_KEY } from "../model/layers.js";
import { inArea } from "../widgets/key_matching.js";

/**
 * @param {{store: import("../model/store.js").Store, grid: import("./pane_grid.js").PaneGrid, gestures: import("./gestures.js").Gestures, layers: import("../model/layers.js").Layers,
 *   layersMenu: import("./layers_menu.js").LayersMenu, say: (text: string) => void}} parts
 */
export function paneBindings({ store, grid, gestures, layers, layersMenu, say }) {
  return inArea("Views", [
    { keys: ["A"], label: "Layers", run: () => layersMenu.toggle() },
    {
      keys: ["Shift 1 – 9"],
      label: "Show or hide a layer, by its number in the menu",
      run: (event) => layers.toggle([BY_KEY[Number(event.code.at(-1)) - 1]]),
    },
    { keys: ["I"], label: "Brightness and contrast of a pane", run: () => grid.openToneMenu() },
    { keys: ["1 – 9"], label: "Fill the grid with a camera (toggle); two digits for 10 to 16", run: (event) => grid.typeCamera(Number(event.key)) },
    { keys: ["PageDown"], label: "Fill the grid with the next camera", run: () => grid.stepFill(1) },
    { keys: ["PageUp"], label: "Fill the grid with the previous camera", run: () => grid.stepFill(-1) },
    { keys: ["0"], label: "Show the whole image", run: () => grid.typeCamera(0) || grid.resetViews() },
    { keys: ["Shift 0"], label: "Zoom all views to the people", run: () => grid.framePeople() },
    { keys: ["Alt 0"], label: "Link the zoom of all views (toggle)", run: () => grid.toggleLink() },
    {
      keys: ["`"],
      label: "Bare picture: hide all drawing while the key left of 1 is held",
      words: "hide show nothing overlay contours joints",
      // The palette has no key to hold: there it is a toggle.
      run: ({ code }) => store.set({ bare: code !== "" || !store.facts.bare }),
      release: () => store.set({ bare: false }),
    },
    {
      keys: ["Alt L"],
      label: "Zoomed views follow the people from frame to frame (toggle)",
      words: "pan track playback steady still",
      run: () => say(`Zoomed views ${grid.togglePeopleFollowed() ? "follow the people." : "stay where they are."}`),
    },
    {
      keys: [],
      label: "Reset the sizes of all panes",
      words: "resize border split automatic",
      why: () => (grid.isResized ? null : "No pane was resized. Drag a border between two panes to do so."),
      run: () => grid.resetSizes(),
    },
    { keys: ["Alt O"], label: "Take the next of the joints that overlap under the pointer", run: () => gestures.offerNext() },
  ]);
}
