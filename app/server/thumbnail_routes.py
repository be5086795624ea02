"""Thumbnails of doubtful poses and of silhouettes, made on demand by one thread of low priority.

They are requests of their own, so that no command, picture or overlay on the pane socket waits for one.
"""

import asyncio
import logging
import os
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from aiohttp import web

from app.remedies import page_text
from tracker.errors import TrackerError

_LOG = logging.getLogger(__name__)
_MAX_WAITING = 16
"""Number of thumbnails that may wait; a page requests two at a time."""
_NICENESS = 10
_MAX_DIGITS = 9

Make = Callable[[int, int, int | None], bytes | None]
"""Makes the thumbnail of a person, frame and limb as JPEG; None if there is none."""
MakeSilhouette = Callable[[int, int], bytes | None]
"""Makes the picture of a camera's silhouette on a frame as JPEG; None if there is none."""


class ThumbnailRoutes:
    """Answers `/thumbnail/PERSON/FRAME` and `/silhouette/CAMERA/FRAME`.

    The query `limb` of the first names the limb that stands out.
    """

    def __init__(self, make: Make, silhouette: MakeSilhouette, is_busy: Callable[[], bool] = lambda: False) -> None:
        """Serve thumbnails.

        Args:
            make: called in the thread of the thumbnails.
            silhouette: called in the same thread.
            is_busy: whether none can be made now, as while kernels are compiled.
        """
        self._make, self._silhouette, self._is_busy = make, silhouette, is_busy
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="thumbnails", initializer=_lower_priority)
        self._n_waiting = 0

    def add_to(self, app: web.Application) -> None:
        """Add the routes to an application."""
        app.router.add_get("/thumbnail/{person}/{frame}", self._answer_pose)
        app.router.add_get("/silhouette/{camera}/{frame}", self._answer_silhouette)
        app.on_cleanup.append(self._close)

    async def _close(self, _: web.Application) -> None:
        self._pool.shutdown(wait=True, cancel_futures=True)

    async def _answer_pose(self, request: web.Request) -> web.Response:
        person, frame = _number(request.match_info["person"]), _number(request.match_info["frame"])
        limb = _number(request.query["limb"]) if "limb" in request.query else None
        missing = f"Expected a pose of person {person} on frame {frame} that a view shows."
        return await self._answer(request, lambda: self._make(person, frame, limb), missing)

    async def _answer_silhouette(self, request: web.Request) -> web.Response:
        camera, frame = _number(request.match_info["camera"]), _number(request.match_info["frame"])
        missing = f"Expected a silhouette of camera {camera} on frame {frame}."
        return await self._answer(request, lambda: self._silhouette(camera, frame), missing)

    async def _answer(self, request: web.Request, make: Callable[[], bytes | None], missing: str) -> web.Response:
        """Make a picture in the thread of the thumbnails; answer 404 with `missing` if there is none."""
        # Without a token, an image in a foreign page could start the work, though never read the result.
        if request.headers.get("Sec-Fetch-Site", "none") not in ("same-origin", "none"):
            raise web.HTTPForbidden(text="Expected a request of this page, found one of another site.")
        if self._n_waiting >= _MAX_WAITING or self._is_busy():
            raise web.HTTPServiceUnavailable(text="No thumbnail can be made now; try again later.")

        def work() -> bytes | None:
            if request.transport is None or request.transport.is_closing():
                return None  # nobody waits for it any more
            return make()

        self._n_waiting += 1
        try:
            made = await asyncio.get_running_loop().run_in_executor(self._pool, work)
        except TrackerError as error:
            _LOG.debug("no thumbnail for %s: %s", request.path, error)
            raise web.HTTPServiceUnavailable(text=page_text(error)) from error
        finally:
            self._n_waiting -= 1
        if made is None:
            raise web.HTTPNotFound(text=missing)
        return web.Response(body=made, content_type="image/jpeg")


def _number(text: str) -> int:
    if not (text.isascii() and text.isdigit() and len(text) <= _MAX_DIGITS):
        raise web.HTTPNotFound(text="Expected an index, found other text.")
    return int(text)


def _lower_priority() -> None:
    """Let everything else have the processor first, where the system allows it for a single thread."""
    if hasattr(os, "setpriority") and os.uname().sysname == "Linux":
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _NICENESS)
