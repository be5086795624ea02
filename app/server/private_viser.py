"""Start viser where only this program can reach it."""

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
from typing import Any, NamedTuple

import viser
import websockets.asyncio.server

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
