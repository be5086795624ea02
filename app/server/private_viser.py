"""Start viser where only this program can reach it.

Forward requests under `/viser/` to viser, which has no check of its own.
"""

import asyncio
import contextlib
import hmac
import inspect
import io
import secrets
import socket
import tempfile
from collections.abc import Generator
from http import HTTPStatus
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple, Self
from urllib.parse import unquote

import aiohttp
import viser
import websockets.asyncio.server
from aiohttp import web
from yarl import URL

from app.runtime.temporary_folder import TemporaryFolder
from tracker.errors import TrackerError
from tracker.system import HAS_UNIX_SOCKETS, MAX_SOCKET_PATH_BYTES, private_listener

SECRET = "X-Quadrille-Secret"
"""Header of each request that viser answers."""


class ViserPlace(NamedTuple):
    """The place at which viser is reached."""

    path: Path | None
    """Its Unix socket; None where the system has none."""
    port: int
    """Its port on 127.0.0.1, if it has no socket."""
    secret: str
    """Value of the header `SECRET`."""


class PrivateViser:
    """A viser server that only `ViserProxy` reaches, which forwards the requests that pass `Access`.

    viser answers every connection, and a browser lets every website connect to every port of this machine. A Unix
    socket is out of reach for websites and, by the permissions of its folder, for other users. Systems without one get
    a port. In both cases a request needs a header with a secret of this program, which no website can send.
    """

    def __init__(self) -> None:
        """Start the server, without the button that would share it with the internet.

        A later `configure_theme` must pass `show_share_button=False` again.

        Raises:
            TrackerError: viser listens on another port than the given one; it is stopped then.
        """
        self._folder = _private_folder()
        try:
            listener, path = private_listener(self._folder.path)
            self.place = ViserPlace(path, 0 if path else listener.getsockname()[1], secrets.token_urlsafe(32))
            # viser prints its own address even with verbose=False; the page's address is the only one to open.
            with _served_on(listener, self.place.secret), contextlib.redirect_stdout(io.StringIO()):
                self.server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
                """The server, to build the scene with."""
            found: object = self.server.get_port()
            if isinstance(found, int) and found != self.place.port:
                self.server.stop()
                raise TrackerError(
                    "expected viser to listen on a private socket, found it on a port that every website can reach; "
                    "install the version of viser that constraints.txt names"
                )
        except BaseException:
            self._folder.close()
            raise
        self.server.gui.configure_theme(show_share_button=False, show_logo=False)

    def stop(self) -> None:
        """Stop the server and remove its socket."""
        self.server.stop()
        self._folder.close()


def _private_folder() -> TemporaryFolder:
    """Make a folder that only this user may enter, with a path short enough for a socket."""
    folder = TemporaryFolder(tempfile.gettempdir())
    if len(bytes(folder.path / "viser")) <= MAX_SOCKET_PATH_BYTES or not HAS_UNIX_SOCKETS:
        return folder
    folder.close()
    return TemporaryFolder("/tmp")


@contextlib.contextmanager
def _served_on(listener: socket.socket, secret: str) -> Generator[None, None, None]:
    """Make `websockets` serve on a socket, whatever host and port its caller passes, and ask for the secret.

    viser has no option for it. It starts the server before its constructor returns, so nothing else is served
    meanwhile.
    """
    original = websockets.asyncio.server.serve

    def serve(handler: Any, host: str, port: int, process_request: Any, **options: Any) -> Any:
        async def answer(connection: Any, request: Any) -> Any:
            if not hmac.compare_digest(request.headers.get(SECRET, "").encode(), secret.encode()):
                return connection.respond(HTTPStatus.FORBIDDEN, "")
            found = process_request(connection, request)
            return await found if inspect.isawaitable(found) else found

        return original(handler, sock=listener, process_request=answer, **options)

    websockets.asyncio.server.serve = serve  # pyrefly: ignore[bad-assignment]
    try:
        yield
    finally:
        websockets.asyncio.server.serve = original


# viser's client is one page that unpacks itself: inline script and style, WebAssembly, workers from blobs.
POLICY = (
    "default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval' 'wasm-unsafe-eval' blob: data:; "
    "worker-src 'self' blob: data:; style-src 'self' 'unsafe-inline' blob: data:; img-src 'self' blob: data:; "
    "font-src 'self' data:; connect-src {sources} blob: data:; frame-src 'self' blob: data:; object-src 'none'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'self'"
)

# Headers of viser that a browser needs; hop-by-hop headers must not be forwarded.
_PASSED_DOWN = ("Content-Type", "Content-Length", "Content-Encoding")
_MAX_MESSAGE_BYTES = 256 << 20
_HEARTBEAT_S = 20.0

Socket = web.WebSocketResponse | aiohttp.ClientWebSocketResponse


def is_viser(path: str) -> bool:
    """Return whether a request path belongs to viser."""
    return path == "/viser" or path.startswith("/viser/")


class ViserProxy:
    """A reverse proxy to one viser server; an asynchronous context that owns its connections."""

    def __init__(self, place: ViserPlace) -> None:
        self._place = place
        self._session: aiohttp.ClientSession | None = None

    async def __aenter__(self) -> Self:
        path, port, secret = self._place
        connector = aiohttp.UnixConnector(str(path), limit=0) if path else aiohttp.TCPConnector(limit=0)
        # Bodies are forwarded as compressed as they arrive.
        self._session = aiohttp.ClientSession(
            "http://viser" if path else f"http://127.0.0.1:{port}",
            auto_decompress=False,
            connector=connector,
            headers={SECRET: secret},
        )
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        assert self._session is not None
        await self._session.close()

    async def handle(self, request: web.Request) -> web.StreamResponse:
        """Answer one request under `/viser`, WebSocket or not."""
        if ".." in unquote(unquote(request.raw_path.partition("?")[0])).replace("\\", "/").split("/"):
            raise web.HTTPNotFound
        try:
            if request.headers.get("Upgrade", "").lower() == "websocket":
                return await self._socket(request)
            if request.path == "/viser":
                raise web.HTTPFound("viser/")  # relative addresses, and those in viser's page, need the slash
            return await self._fetch(request)
        except aiohttp.ClientError as error:
            raise web.HTTPBadGateway(text="The 3-D view does not answer; start quadrille again.\n") from error

    async def _fetch(self, request: web.Request) -> web.StreamResponse:
        assert self._session is not None
        path = request.raw_path.removeprefix("/viser")
        headers = {"Accept-Encoding": request.headers.get("Accept-Encoding", "identity")}
        async with self._session.get(URL(path, encoded=True), headers=headers, allow_redirects=False) as upstream:
            passed = {name: upstream.headers[name] for name in _PASSED_DOWN if name in upstream.headers}
            response = web.StreamResponse(status=upstream.status, headers=passed)
            await response.prepare(request)
            async for chunk in upstream.content.iter_chunked(1 << 16):
                await response.write(chunk)
            await response.write_eof()
            return response

    async def _socket(self, request: web.Request) -> web.StreamResponse:
        assert self._session is not None
        # viser recognizes versions of its client by the subprotocol: pass on the one that viser chose.
        offered = [p.strip() for p in request.headers.get("Sec-WebSocket-Protocol", "").split(",") if p.strip()]
        async with self._session.ws_connect(
            "/", protocols=offered, max_msg_size=_MAX_MESSAGE_BYTES, compress=0
        ) as upstream:
            chosen = [upstream.protocol] if upstream.protocol else []
            downstream = web.WebSocketResponse(
                protocols=chosen, heartbeat=_HEARTBEAT_S, max_msg_size=_MAX_MESSAGE_BYTES, compress=False
            )
            await downstream.prepare(request)
            pumps = {
                asyncio.ensure_future(_pump(upstream, downstream)),
                asyncio.ensure_future(_pump(downstream, upstream)),
            }
            try:
                await asyncio.wait(pumps, return_when=asyncio.FIRST_COMPLETED)
            finally:
                for pump in pumps:
                    pump.cancel()
                await asyncio.gather(*pumps, return_exceptions=True)
            return downstream


async def _pump(source: Socket, target: Socket) -> None:
    """Forward messages until the source closes, then close the target with the same code.

    Sending waits while the target's buffer is full, which stops reading from the source.
    """
    while True:
        message = await source.receive()
        try:
            if message.type is aiohttp.WSMsgType.BINARY:
                await target.send_bytes(message.data)
            elif message.type is aiohttp.WSMsgType.TEXT:
                await target.send_str(message.data)
            else:
                code = source.close_code
                # 1005 and 1006 mean that no code was received, and must not be sent.
                sendable = code is not None and (1000 <= code <= 1003 or 1007 <= code <= 1014 or code >= 3000)
                reason = message.extra.encode() if isinstance(message.extra, str) else b""
                await target.close(code=code if sendable and code else aiohttp.WSCloseCode.GOING_AWAY, message=reason)
                return
        except ConnectionError:
            return
