"""Start viser on a Unix socket that only this user can reach."""

import contextlib
import io
import socket
import tempfile
from collections.abc import Generator
from pathlib import Path
from typing import Any

import viser
import websockets.asyncio.server

from app.runtime.temporary_folder import TemporaryFolder
from tracker.errors import TrackerError

_MAX_PATH_BYTES = 100  # the kernel's limit for the path of a Unix socket is 104 to 108 bytes


class PrivateViser:
    """A viser server that listens on no port.

    viser answers every connection, and a browser lets every website connect to every port of this machine. A Unix
    socket is out of reach for websites and, by the permissions of its folder, for other users. `ViserProxy` forwards
    the requests that pass `Access`.
    """

    def __init__(self) -> None:
        """Start the server, without the button that would share it with the internet.

        A later `configure_theme` must pass `show_share_button=False` again.

        Raises:
            TrackerError: viser did not use the socket; nothing listens then.
        """
        self._folder = _private_folder()
        self.socket_path = self._folder.path / "viser"
        """The socket; only this user may open it."""
        try:
            # viser prints its own address even with verbose=False; the page's address is the only one to open.
            with _served_on(self.socket_path), contextlib.redirect_stdout(io.StringIO()):
                self.server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
                """The server, to build the scene with."""
            if isinstance(self.server.get_port(), int):
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
    if len(bytes(folder.path / "viser")) <= _MAX_PATH_BYTES:
        return folder
    folder.close()
    return TemporaryFolder("/tmp")


@contextlib.contextmanager
def _served_on(path: Path) -> Generator[None, None, None]:
    """Make `websockets` serve on a Unix socket at `path`, whatever host and port its caller passes.

    viser has no option for it. It starts the server before its constructor returns, so nothing else is served
    meanwhile.
    """
    original = websockets.asyncio.server.serve
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    listener.bind(str(path))

    def serve(handler: Any, host: str, port: int, **options: Any) -> Any:
        return original(handler, sock=listener, **options)

    websockets.asyncio.server.serve = serve  # pyrefly: ignore[bad-assignment]
    try:
        yield
    finally:
        websockets.asyncio.server.serve = original
