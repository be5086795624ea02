/**
 * Model: what the page knows and what it can ask of the program.
 *
 * The room holds the store, the connection with its messages, and the actions of a user. It imports only types of `widgets`.
 */

import { makeActions } from "./actions.js";
import { makeConnection } from "./connection.js";
import { makeImageTones } from "./image_tone.js";
import { Latency } from "../widgets/latency.js";
import { makeLayers } from "./layers.js";
import { makeNavigation } from "./navigation.js";
import { makeReceiver } from "./receiver.js";
import { RecentImages } from "./recent_images.js";
import { Store } from "./store.js";
import { makeThemes } from "./theme.js";
import { isAllowed, isAsked, refusalOf, unavailableReasons } from "./unavailable_reasons.js";

/**
 * @typedef {import("./protocol.js").ClientMessage} ClientMessage
 * @typedef {import("./protocol.js").NoticeMessage} NoticeMessage
 * @typedef {ReturnType<typeof mount>} Context what all other rooms are mounted with
 */

/** Messages after which the program may go to another frame. @type {ClientMessage["type"][]} */
const MOVING = ["undo", "redo", "go_to"];

/** Create the model. The page connects to the program only when `connect` is called, after all rooms are mounted. */
export function mount() {
  const store = new Store();
  const latency = new Latency();
  const recentImages = new RecentImages();
  /** @type {((notice: NoticeMessage) => void)[]} */
  const noticeListeners = [];
  const notify = (/** @type {NoticeMessage} */ notice) => noticeListeners.forEach((listener) => listener(notice));
  const say = (/** @type {string} */ text, /** @type {NoticeMessage["level"]} */ level = "info") => notify({ type: "notice", level, text });
  /** @type {import("./connection.js").Connection | null} */
  let connection = null;
  const send = (/** @type {ClientMessage} */ message) => {
    const { session } = store.facts;
    if (session && !isAllowed(message, session)) {
      if (isAsked(message)) say(refusalOf(session, store.facts.presence?.link ?? session.role));
      return;
    }
    if (MOVING.includes(message.type)) navigation.expectMove();
    connection?.send(message);
  };
  const navigation = makeNavigation(store, send);
  const receiver = makeReceiver(store, notify, send, recentImages);
  return {
    store,
    send,
    say,
    latency,
    recentImages,
    actions: makeActions(store, send),
    navigation,
    layers: makeLayers(store),
    imageTones: makeImageTones(store),
    themes: makeThemes(store),
    reasons: unavailableReasons(store),

    /** @param {string} name by which this page joins from now on; empty for none */
    joinAs(name) {
      connection?.joinAs(name);
    },

    /** @param {(notice: NoticeMessage) => void} listener shows notices of the program and of the page */
    onNotice(listener) {
      noticeListeners.push(listener);
    },

    /** @param {ClientMessage | null} greeting sent first on every connection */
    connect(greeting) {
      connection = makeConnection(receiver, greeting, () => store.facts.opening === null);
    },
  };
}
