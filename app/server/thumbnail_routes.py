"""Thumbnails of doubtful poses, made on demand by one thread of low priority.

They are requests of their own, so that no command, picture or overlay on the pane socket waits for one.
"""

import asyncio
import logging
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from aiohttp import web

from app.remedies import page_text
from app.server.page_requests import require_page
from tracker.errors import TrackerError
from tracker.system import give_way_in_thread

_LOG = logging.getLogger(__name__)
_MAX_WAITING = 16
"""Number of thumbnails that may wait; a page requests two at a time."""
_MAX_DIGITS = 9

Make = Callable[[int, int, int | None, bool], bytes | None]
"""Makes the thumbnail of a person, frame and limb as JPEG, with blurred heads or not; None if there is none."""


class ThumbnailRoutes:
    """Answers `/thumbnail/PERSON/FRAME`, whose query `limb` names the limb that stands out; `blurred` blurs heads."""

    def __init__(self, make: Make, is_busy: Callable[[], bool] = lambda: False) -> None:
        """Serve thumbnails.

        Args:
            make: called in the thread of the thumbnails.
            is_busy: whether none can be made now, as while kernels are compiled.
        """
        self._make, self._is_busy = make, is_busy
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="thumbnails", initializer=give_way_in_thread)
        self._n_waiting = 0

    def add_to(self, app: web.Application) -> None:
        """Add the routes to an application."""
        app.router.add_get("/thumbnail/{person}/{frame}", self._answer)
        app.on_cleanup.append(self._close)

    async def _close(self, _: web.Application) -> None:
        self._pool.shutdown(wait=True, cancel_futures=True)

    async def _answer(self, request: web.Request) -> web.Response:
        """Make a picture in the thread of the thumbnails."""
        person, frame = _number(request.match_info["person"]), _number(request.match_info["frame"])
        limb = _number(request.query["limb"]) if "limb" in request.query else None
        require_page(request, None)
        if self._n_waiting >= _MAX_WAITING or self._is_busy():
            raise web.HTTPServiceUnavailable(text="No thumbnail can be made now; try again later.")

        def work() -> bytes | None:
            if request.transport is None or request.transport.is_closing():
                return None  # nobody waits for it any more
            return self._make(person, frame, limb, "blurred" in request.query)

        self._n_waiting += 1
        try:
            made = await asyncio.get_running_loop().run_in_executor(self._pool, work)
        except TrackerError as error:
            _LOG.debug("no thumbnail for %s: %s", request.path, error)
            raise web.HTTPServiceUnavailable(text=page_text(error)) from error
        finally:
            self._n_waiting -= 1
        if made is None:
            raise web.HTTPNotFound(text=f"Expected a pose of person {person} on frame {frame} that a view shows.")
        return web.Response(body=made, content_type="image/jpeg")


def _number(text: str) -> int:
    if not (text.isascii() and text.isdigit() and len(text) <= _MAX_DIGITS):
        raise web.HTTPNotFound(text="Expected an index, found other text.")
    return int(text)
