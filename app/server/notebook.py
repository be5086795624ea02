"""Serve the page of a session from another program, such as a notebook, in a thread."""

import threading
from collections.abc import Callable, Sequence
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Self

import imageio.v3 as iio
import numpy as np

from app.export.overlay_video import draw_people
from tracker.errors import TrackerError
from tracker.geometry.arrays import Array, Image
from tracker.session.lock import SessionLock
from tracker.session.relink import require_files
from tracker.session.session import Session, load_session

if TYPE_CHECKING:
    from app.control.controller import Controller

_START_S = 120.0
"""Time for the page to answer, s: on a new machine kernels are compiled meanwhile."""


class ServedPage:
    """The page of a session, from `with serve(...)` to the end of the block. Its session is locked meanwhile."""

    def __init__(self, folder: Path, port: int) -> None:
        """Use `serve`."""
        self._folder, self._port = folder, port
        self._ready, self._error = threading.Event(), list[BaseException]()
        self._controller: Controller | None = None
        self._stop: Callable[[], None] = lambda: None
        self._thread = threading.Thread(target=self._serve, name="quadrille", daemon=True)
        self.address = ""
        """The page's address, with its token."""

    def __enter__(self) -> Self:
        """Serve.

        Raises:
            TrackerError: another program has the session open, or footage is missing.
        """
        self._thread.start()
        if not self._ready.wait(_START_S):
            raise TrackerError(f"expected the page within {_START_S:.0f} s, found none; try again")
        if self._error:
            raise self._error[0]
        return self

    def __exit__(self, *_: object) -> None:
        """Store what is open, and end."""
        self._stop()
        self._thread.join()

    @property
    def session(self) -> Session:
        """The open session, with the present bodies."""
        return self._open.session

    def show(self, frame: int) -> None:
        """Show a frame."""
        self._open.navigation.seek(frame)

    def pose(self, person: str) -> Array:
        """Return the shown pose of a person, (n_values,)."""
        return self._open.state.poses[self._index(person)]

    def set_pose(self, person: str, values: Sequence[float] | Array) -> None:
        """Set the pose of a person on the shown frame, (n_values,), as a keyframe and an entry of the history.

        Raises:
            TrackerError: it is not a pose of the person's body.
        """
        self._open.pose_edits.set_values(self._index(person), np.asarray(values, dtype=np.float64))

    def picture(self, camera: str) -> Image:
        """Return the shown frame of a camera with the people drawn over it, (h, w, 3), RGB.

        Raises:
            TrackerError: there is no such camera.
        """
        names = self.session.camera_names
        if camera not in names:
            raise TrackerError(f"expected a camera among {', '.join(names)}, found '{camera}'; name one of them")
        state = self._open.state
        index = names.index(camera)
        image = self._open.frames.observer.recording.read_view(index, state.frame)
        return draw_people(self._open.session_of(state), state, index, image)

    def png(self, camera: str) -> bytes:
        """Return `picture` as a PNG file, which a notebook shows."""
        return bytes(iio.imwrite("<bytes>", self.picture(camera), extension=".png"))

    @property
    def _open(self) -> "Controller":
        assert self._controller is not None, "the page is served within the block alone"
        return self._controller

    def _index(self, person: str) -> int:
        names = [p.name for p in self.session.people]
        if person not in names:
            raise TrackerError(f"expected a person among {', '.join(names)}, found '{person}'; name one of them")
        return names.index(person)

    def _serve(self) -> None:
        try:
            self._serve_session()
        except BaseException as error:
            self._error.append(error)
        finally:
            self._controller = None
            self._ready.set()

    def _serve_session(self) -> None:
        from app.runtime.kernel_compiler import KernelCompiler
        from app.server.address import Serving
        from app.server.startup_server import StartupServer
        from app.server.workbench import serve_until_closed

        serving = Serving(port=self._port, browser=False)
        with SessionLock(self._folder), StartupServer(serving) as doorway, closing(KernelCompiler()) as compiler:
            session = load_session(self._folder)
            require_files(session)

            def begun(controller: "Controller", stop: Callable[[], None]) -> None:
                self._controller, self._stop, self.address = controller, stop, doorway.address
                self._ready.set()

            serve_until_closed(session, doorway, compiler, lambda line: None, begun=begun)


def serve(session: Session | str | Path, port: int = 0) -> ServedPage:
    """Serve the page of a session in a thread, within a `with` block.

        with serve("walk") as page:
            print(page.address)

    Args:
        session: the session or its folder.
        port: to listen at; a free one by default.
    """
    return ServedPage(session.folder if isinstance(session, Session) else Path(session), port)
