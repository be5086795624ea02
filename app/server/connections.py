"""Bound the number and the age of connections, so that idle or hostile ones leave room for the page."""

import asyncio
from collections.abc import Callable, Sequence
from typing import Any

from aiohttp import web
from aiohttp.http_parser import RawRequestMessage
from yarl import URL

MAX_CONNECTIONS = 100
"""Connections at a time. A page has about eight; some systems allow a process 256 open files."""
HEADERS_S = 10.0
"""Time from the connection to the end of its first request's headers."""
ANSWER_S = 300.0
"""Time from a request to the next one or the end. A WebSocket has no limit: its heartbeat finds dead peers."""
KEEPALIVE_S = 30.0
"""Time until an idle connection is closed, and within which the headers of a later request must arrive."""
LINGER_S = 2.0
"""Time for the rest of a body that nobody reads: the server answers requests without one."""
_FULL = (
    b"HTTP/1.1 503 Service Unavailable\r\nContent-Type: text/plain; charset=utf-8\r\nConnection: close\r\n"
    b"Retry-After: 10\r\n\r\nQuadrille has as many connections as it can serve; close other pages and reload.\n"
)


class LimitedRunner(web.AppRunner):
    """A runner whose sites limit the number and the age of their connections."""

    def __init__(self, app: web.Application, roots: Sequence[str] = ()) -> None:
        """Prepare to run an application, without a log of its requests.

        Args:
            app: the application.
            roots: paths below which it is served, besides its own paths.
        """
        self._roots = [root for root in roots if root != "/"]
        super().__init__(
            app, access_log=None, handle_signals=False, shutdown_timeout=2.0, keepalive_timeout=KEEPALIVE_S,
            lingering_time=LINGER_S,
        )  # fmt: skip
        self._open: dict[_Connection, None] = {}  # in the order of their beginning

    async def _make_server(self) -> web.Server:
        server = await super()._make_server()
        make_request, roots = server.request_factory, self._roots

        def make_routed(message: RawRequestMessage, *args: Any) -> web.BaseRequest:
            root = next((root for root in roots if message.path.startswith(root)), None)
            if root is not None:
                path = message.path.removeprefix(root[:-1])
                message = message._replace(path=path, url=URL(path, encoded=True))
            return make_request(message, *args)

        server.request_factory = make_routed
        return server

    @property
    def server(self) -> Callable[[], asyncio.Protocol] | None:  # pyrefly: ignore[bad-override]
        """The factory that sites call for each connection."""
        inner = super().server
        return None if inner is None else lambda: _Connection(inner(), self._open)


def request_arrived(request: web.Request) -> None:
    """Note that the headers of a request have arrived: its connection has `ANSWER_S` now."""
    if (connection := _connection_of(request)) is not None:
        connection.has_asked = True
        connection.expire_in(ANSWER_S)


def keep_open(request: web.Request) -> None:
    """Lift the limit of age for an answer that takes long to make; a later request limits it again."""
    if (connection := _connection_of(request)) is not None:
        connection.expire_in(None)


async def keep_sockets(request: web.Request, response: web.StreamResponse) -> None:
    """Lift the limit of age for a WebSocket; a signal for `on_response_prepare`."""
    if isinstance(response, web.WebSocketResponse):
        keep_open(request)


class _Connection(asyncio.Protocol):
    """Passes the events of a connection to aiohttp's protocol unless it is refused or expires."""

    def __init__(self, inner: asyncio.Protocol, others: "dict[_Connection, None]") -> None:
        self.has_asked = False
        self._inner, self._others = inner, others
        self._transport: asyncio.Transport | None = None
        self._is_refused = False
        self._expiry: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        assert isinstance(transport, asyncio.Transport)
        self._transport = transport
        if len(self._others) >= MAX_CONNECTIONS:
            oldest = next((c for c in self._others if not c.has_asked), None)
            if oldest is None:
                self._is_refused = True
                transport.write(_FULL)
                transport.close()
                return
            oldest.end()
        self._others[self] = None
        self.expire_in(HEADERS_S)
        self._inner.connection_made(transport)

    def expire_in(self, seconds: float | None) -> None:
        """End the connection after a time, or not at all; replaces an earlier limit."""
        if self._expiry is not None:
            self._expiry.cancel()
        self._expiry = None if seconds is None else asyncio.get_running_loop().call_later(seconds, self.end)

    def end(self) -> None:
        """End the connection at once; what it has not read is lost."""
        self._others.pop(self, None)
        if self._transport is not None:
            self._transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        self.expire_in(None)
        self._others.pop(self, None)
        if not self._is_refused:
            self._inner.connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        if not self._is_refused:
            self._inner.data_received(data)

    def eof_received(self) -> bool | None:
        return None if self._is_refused else self._inner.eof_received()

    def pause_writing(self) -> None:
        if not self._is_refused:
            self._inner.pause_writing()

    def resume_writing(self) -> None:
        if not self._is_refused:
            self._inner.resume_writing()


def _connection_of(request: web.Request) -> _Connection | None:
    """Return the connection of a request; None if it is gone, or its site has no limits."""
    protocol = request.transport.get_protocol() if isinstance(request.transport, asyncio.Transport) else None
    return protocol if isinstance(protocol, _Connection) else None
