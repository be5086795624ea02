/** Pane socket: reconnects automatically, and passes messages to a listener. */

const FIRST_DELAY_MS = 250;
const MAX_DELAY_MS = 5000;
/** Where the name is kept by which this tab joins: each tab may have another. */
const NAME_KEY = "quadrille-name";

/** The name by which this tab joins; empty for none. */
export function joinedName() {
  return sessionStorage.getItem(NAME_KEY) ?? "";
}

/**
 * @typedef {object} Listener
 * @property {(open: boolean) => void} onOpen called when the connection opens or is lost
 * @property {(message: import("./protocol.js").TextMessage) => void} onText
 * @property {(header: import("./protocol.js").BinaryHeader, payload: ArrayBuffer) => void} onBinary
 */

/** Join without a name from now on: the one that was asked for could not be had. */
export function forgetName() {
  sessionStorage.removeItem(NAME_KEY);
}

/** @typedef {ReturnType<typeof makeConnection>} Connection */

/**
 * @param {Listener} listener
 * @param {import("./protocol.js").ClientMessage | null} greeting sent first on every connection
 * @param {() => boolean} isWanted whether to connect again; asked before each attempt
 */
export function makeConnection(listener, greeting = null, isWanted = () => true) {
  /** @type {WebSocket | null} */
  let current = null;
  let delayMs = FIRST_DELAY_MS;
  connect();
  // Reconnect immediately when the network is back.
  addEventListener("online", () => connect());

  /**
   * Send a message, or drop it without a connection: the program sends its whole state on each new connection.
   *
   * @param {import("./protocol.js").ClientMessage} message
   */
  function send(message) {
    if (current?.readyState === WebSocket.OPEN) current.send(JSON.stringify(message));
  }

  /**
   * Join by another name, with a new connection.
   *
   * @param {string} name empty for none
   */
  function joinAs(name) {
    sessionStorage.setItem(NAME_KEY, name);
    delayMs = 0;
    current?.close();
  }

  function connect() {
    if (current && current.readyState !== WebSocket.CLOSED) return;
    const url = new URL("ws", document.baseURI);
    url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
    url.search = new URLSearchParams(joinedName() ? { name: joinedName() } : {}).toString();
    const socket = new WebSocket(url);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      delayMs = FIRST_DELAY_MS;
      if (greeting) send(greeting);
      listener.onOpen(true);
    };
    socket.onmessage = ({ data }) => {
      if (typeof data === "string") {
        listener.onText(JSON.parse(data));
      } else {
        const { header, payload } = decodeBinary(data);
        listener.onBinary(header, payload);
      }
    };
    socket.onclose = () => {
      listener.onOpen(false);
      connectLater();
    };
    current = socket;
  }

  function connectLater() {
    setTimeout(() => (isWanted() ? connect() : connectLater()), delayMs * (0.75 + 0.5 * Math.random()));
    delayMs = Math.min(2 * delayMs, MAX_DELAY_MS);
  }

  return { send, joinAs };
}

/**
 * Take a binary message apart: `[uint32 LE header length][header JSON][payload]`.
 *
 * @param {ArrayBuffer} buffer
 * @returns {{header: import("./protocol.js").BinaryHeader, payload: ArrayBuffer}}
 */
function decodeBinary(buffer) {
  const headerLength = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, headerLength)));
  return { header, payload: buffer.slice(4 + headerLength) };
}
