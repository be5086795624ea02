/** Mount the rooms of the page in order, then connect to the program, once it has started. */

import * as annotationRoom from "./annotation/index.js";
import * as inspectorRoom from "./inspector/index.js";
import * as model from "./model/index.js";
import * as participantsRoom from "./participants/index.js";
import * as panesRoom from "./panes/index.js";
import * as posingRoom from "./posing/index.js";
import * as sceneRoom from "./scene/index.js";
import * as searchRoom from "./search/index.js";
import * as sessionsRoom from "./sessions/index.js";
import * as shellRoom from "./shell/index.js";
import { exposeState } from "./shell/test_hook.js";
import { started } from "./starting/index.js";
import * as timelineRoom from "./timeline/index.js";

const context = model.mount();
const panes = panesRoom.mount(context);
const posing = posingRoom.mount(context, panes);
const timeline = timelineRoom.mount(context, panes, posing);
const search = searchRoom.mount(context, timeline);
const scene = sceneRoom.mount(context, panes);
const sessions = sessionsRoom.mount(context);
const inspector = inspectorRoom.mount(context, { panes, posing, timeline, scene, sessions });
const annotation = annotationRoom.mount(context, { panes, inspector });
const participants = participantsRoom.mount(context);
const bindings = shellRoom.mount(context, { panes, posing, timeline, search, scene, inspector, annotation, participants, sessions });
exposeState(context, panes.grid, bindings);

await started;
// The access token is in a cookie by now. It should not stay in the address.
if (location.search) window.history.replaceState(null, "", location.pathname);
context.connect(scene.isSoftware ? { type: "pause_3d", pause: true } : null);
