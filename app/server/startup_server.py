"""Answer at once: the page, which says what the program is doing and waits until the program serves the same port.

Loading the program takes seconds, on a busy machine many. The browser loads the page meanwhile. This module imports
little. The page holds nothing of the session, so it needs no token; Host and Origin are checked as for every request.
"""

import json
import os
import signal
import socket
import threading
import webbrowser
from contextlib import suppress
from dataclasses import replace
from functools import partial
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from multiprocessing.process import BaseProcess
from socketserver import BaseServer
from types import TracebackType
from typing import Any, NamedTuple, Self

from platformdirs import user_state_path

from app.runtime.restart import inherited
from app.server.access import access_for
from app.server.address import Serving, listen, page_address, port_of
from app.server.static_files import KEPT, POLICY, PREFIX, PageFiles, connect_sources, static_folder
from app.state.role import Role
from tracker.system import FORKS, start_child

STEPS = ("Loading the program", "Opening the session", "Preparing the views")
_ICON = "icon.svg"
_NOT_KEPT = "no-store"
_TIMEOUT_S = 2.0
"""Time for a request to arrive: browsers also open connections that they do not use."""
_POLL_S = 0.02


class Answer(NamedTuple):
    """The answer to a request."""

    status: int
    content: bytes
    kind: str
    """Content type."""
    caching: str = _NOT_KEPT
    """Cache-Control."""


class StartupServer:
    """Serves the page at listening sockets, from `with` to `close`."""

    def __init__(self, serving: Serving) -> None:
        """Listen, and read the page.

        Args:
            serving: address and access of the page.

        Raises:
            TrackerError: the port is taken, the address is not this machine's, or the access is not safe.
        """
        self.serving = serving
        tokens = user_state_path("quadrille", appauthor=False)
        self.access = access_for(serving.host, serving.allow_hosts, serving.token, tokens, serving.share)
        """Requirements of the program; the doorway asks for no token."""
        static = static_folder()
        self._icon = (static / _ICON).read_bytes()
        self._page_files = PageFiles(static)
        self._step = 0
        self.sockets = inherited() or listen(serving.host, serving.port)
        """They listen until the end of the `with` block; who serves copies of them calls `close` before."""
        self.port = port_of(self.sockets)
        self._servers = [_Server(each, self) for each in self.sockets]
        self._threads: list[tuple[_Server, threading.Thread]] = []
        self._process: BaseProcess | None = None
        self._steps = -1  # pipe to the process

    @property
    def address(self) -> str:
        """The page's address, with the token if one is required."""
        return page_address(self.access, self.serving.host, self.port)

    @property
    def shared_addresses(self) -> dict[Role, str]:
        """Addresses for other people, by role."""
        links = {link.role: replace(self.access, token=link.token) for link in self.access.links}
        return {role: page_address(access, self.serving.host, self.port) for role, access in links.items()}

    def __enter__(self) -> Self:
        """Begin to answer."""
        if FORKS:  # threads would take turns with the loading program, and hold it up
            reading, self._steps = os.pipe()
            self._process = start_child(self._answer_until_closed, reading)
            os.close(reading)
        else:
            self._start_threads()
        return self

    def _start_threads(self) -> None:
        """Answer, each server in a thread. Python 3.13 does not start threads that were made before a fork."""
        for server in self._servers:
            thread = threading.Thread(target=server.serve_forever, args=(_POLL_S,), daemon=True)
            thread.start()
            self._threads.append((server, thread))

    def _answer_until_closed(self, steps: int) -> None:
        """Answer in a process of its own until the program closes the doorway, or ends in whatever way.

        Args:
            steps: pipe from which the present step is read.
        """
        os.close(self._steps)
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl+C is for the program
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        self._page_files.index()  # joined before the first request, while the program loads
        self._start_threads()
        while step := os.read(steps, 1):
            self._step = step[0]

    def open_browser(self) -> None:
        """Open the page in the browser if that is wanted."""
        if self.serving.browser:
            # The token is the invitation: other accounts see the address of a browser.
            code = self.access.invitation.code if self.access.invitation else self.access.token
            opened = page_address(replace(self.access, token=code), self.serving.host, self.port)
            threading.Thread(target=webbrowser.open, args=(opened,), daemon=True).start()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End to answer, and to listen."""
        self.close()
        for each in self.sockets:
            each.close()

    def show(self, step: str) -> None:
        """Show what the program is doing, one of `STEPS`."""
        self._step = STEPS.index(step)
        if self._process is not None:
            with suppress(BrokenPipeError):
                os.write(self._steps, bytes([self._step]))

    def close(self) -> None:
        """End to answer; requests that arrive later wait for who serves the sockets next."""
        if self._process is not None:
            os.close(self._steps)
            self._process.join()
            self._process = None
        while self._threads:
            server, thread = self._threads.pop()
            server.shutdown()
            thread.join()

    def answer(self, path: str, host: str | None, origin: str | None) -> Answer:
        """Answer a request."""
        why = self.access.refusal(host, origin)
        if why is not None:
            return Answer(HTTPStatus.FORBIDDEN, f"Quadrille refused this request: {why}.\n".encode(), "text/plain")
        if path == "/starting.json":
            return Answer(HTTPStatus.OK, json.dumps({"steps": STEPS, "at": self._step}).encode(), "application/json")
        if path == "/":
            return Answer(HTTPStatus.OK, self._page_files.index(is_starting=True).encode(), "text/html; charset=utf-8")
        if path == f"/{PREFIX}{_ICON}":
            return Answer(HTTPStatus.OK, self._icon, "image/svg+xml")
        found = self._page_files.find(path)
        if found is not None:
            return Answer(HTTPStatus.OK, *found, KEPT)
        return Answer(HTTPStatus.SERVICE_UNAVAILABLE, b"The program is starting.\n", "text/plain")


class _Server(ThreadingHTTPServer):
    daemon_threads = True

    def __init__(self, listening: socket.socket, doorway: StartupServer) -> None:
        super().__init__(listening.getsockname()[:2], partial(_Handler, doorway), bind_and_activate=False)
        self.socket.close()
        self.socket = listening

    def handle_error(self, request: object, client_address: object) -> None:
        """Pass over pages that went away."""


class _Handler(BaseHTTPRequestHandler):
    timeout = _TIMEOUT_S

    def __init__(self, doorway: StartupServer, request: socket.socket, address: Any, server: BaseServer) -> None:
        self._doorway = doorway
        super().__init__(request, address, server)  # answers the request

    def do_GET(self) -> None:
        """Answer a request; the connection ends with it."""
        hosts = self.headers.get_all("Host", [])
        host = hosts[0] if len(hosts) == 1 else None
        path = self.path.partition("?")[0]
        for root in self._doorway.access.roots:
            if path.startswith(root):
                path = "/" + path.removeprefix(root)
        answer = self._doorway.answer(path, host, self.headers.get("Origin"))
        sources = "'none'" if host is None or answer.status == HTTPStatus.FORBIDDEN else connect_sources(host)
        with suppress(OSError):
            self.send_response(answer.status)
            for name, value in (
                ("Content-Type", answer.kind),
                ("Content-Length", str(len(answer.content))),
                ("Content-Security-Policy", POLICY.format(sources=sources)),
                ("X-Content-Type-Options", "nosniff"),
                ("Referrer-Policy", "no-referrer"),
                ("Cache-Control", answer.caching),
                ("Connection", "close"),
            ):
                self.send_header(name, value)
            self.end_headers()
            self.wfile.write(answer.content)

    def log_message(self, format: str, *args: object) -> None:
        """Say nothing on the terminal."""
