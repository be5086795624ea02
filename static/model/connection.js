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

export class Connection {
  /** @type {WebSocket | null} */
  #socket = null;
  #delayMs = FIRST_DELAY_MS;
  /** @type {Listener} */
  #listener;

  /** @type {import("./protocol.js").ClientMessage | null} */
  #greeting;
  #isWanted;

  /**
   * @param {Listener} listener
   * @param {import("./protocol.js").ClientMessage | null} greeting sent first on every connection
   * @param {() => boolean} isWanted whether to connect again; asked before each attempt
   */
  constructor(listener, greeting = null, isWanted = () => true) {
    this.#listener = listener;
    this.#greeting = greeting;
    this.#isWanted = isWanted;
    this.#connect();
    // Reconnect immediately when the network is back.
    addEventListener("online", () => this.#connect());
  }

  /**
   * Send a message, or drop it without a connection: the program sends its whole state on each new connection.
   *
   * @param {import("./protocol.js").ClientMessage} message
   */
  send(message) {
    if (this.#socket?.readyState === WebSocket.OPEN) this.#socket.send(JSON.stringify(message));
  }

  /**
   * Join by another name, with a new connection.
   *
   * @param {string} name empty for none
   */
  joinAs(name) {
    sessionStorage.setItem(NAME_KEY, name);
    this.#delayMs = 0;
    this.#socket?.close();
  }

  #connect() {
    if (this.#socket && this.#socket.readyState !== WebSocket.CLOSED) return;
    const url = new URL("ws", document.baseURI);
    url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
    url.search = new URLSearchParams(joinedName() ? { name: joinedName() } : {}).toString();
    const socket = new WebSocket(url);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.#delayMs = FIRST_DELAY_MS;
      if (this.#greeting) this.send(this.#greeting);
      this.#listener.onOpen(true);
    };
    socket.onmessage = ({ data }) => {
      if (typeof data === "string") {
        this.#listener.onText(JSON.parse(data));
      } else {
        const { header, payload } = decodeBinary(data);
        this.#listener.onBinary(header, payload);
      }
    };
    socket.onclose = () => {
      this.#listener.onOpen(false);
      this.#connectLater();
    };
    this.#socket = socket;
  }

  #connectLater() {
    setTimeout(() => (this.#isWanted() ? this.#connect() : this.#connectLater()), this.#delayMs * (0.75 + 0.5 * Math.random()));
    this.#delayMs = Math.min(2 * this.#delayMs, MAX_DELAY_MS);
  }
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
