"""Thumbnails of doubtful poses: one person on one frame, in the view that shows a limb best.

One thread of low priority makes them on demand. They are requests of their own, so that no command, picture or overlay
on the pane socket waits for one.
"""

import asyncio
import logging
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from aiohttp import web

from app.control.controller import Controller
from app.drawing import thumbnails
from app.drawing.joint_handles import circles_around, head_surfaces
from app.remedies import page_text
from app.server.page_requests import require_page
from app.session.footage_pictures import FootageCrops
from app.state.identity import ObjectIdentity
from tracker.body.limbs import limbs
from tracker.body.model import BodyModel, PosedBody, ahead
from tracker.errors import TrackerError
from tracker.interchange.exports.faces import blurred
from tracker.system import give_way_in_thread

_CACHED = 256
"""Number of thumbnails that are kept, some 8 kB each."""
_PAUSE_S, _MAX_PAUSE_S = 0.02, 1.0
"""How long a thumbnail waits at a time, and at most, while pictures are made or a pose is dragged."""


class _Wanted(NamedTuple):
    """Content of a thumbnail, for comparison. Bodies are compared by identity: a changed body makes another."""

    frame: int
    person: int
    """Index among the bodies."""
    limb: int | None
    bodies: tuple[BodyModel, ...]
    """Of all people with a pose on the frame."""
    poses: tuple[bytes, ...]
    """Their values as float64, which can be hashed."""
    velocities: tuple[bytes | None, ...]
    """Their velocities likewise, where a camera needs them."""
    colors: tuple[str, ...]
    is_blurred: bool
    """Whether heads are."""
    cameras: ObjectIdentity
    """Of the session: corrected ones make another thumbnail."""


class Thumbnails:
    """Makes thumbnails in the thread of its caller; only one at a time. It changes no state."""

    def __init__(self, controller: Controller, footage: FootageCrops) -> None:
        """Make none yet.

        Args:
            controller: of the session.
            footage: gives the images.
        """
        self._controller, self._footage, self._cameras = controller, footage, controller.session.cameras
        self._drawn = lru_cache(_CACHED)(self._draw)

    def jpeg(self, person: int, frame: int, limb: int | None, is_blurred: bool = False) -> bytes | None:
        """Return a thumbnail of a stored pose as JPEG; None if there is no such pose or no view shows it.

        Args:
            person: index of the person.
            frame: of the pose.
            limb: index of the limb of the person's body that stands out; None, or one that it lacks, for none.
            is_blurred: whether heads are blurred.

        Raises:
            RecordingError: the footage cannot be read.
        """
        stored = self._controller.stored_poses.on_frame(frame)
        if person not in stored:
            return None
        if limb is not None and not 0 <= limb < len(limbs(stored[person].model)):
            limb = None
        bodies = tuple(stored.values())
        colors = tuple(self._controller.session.people[i].color for i in stored)
        return self._drawn(
            _Wanted(
                frame, list(stored).index(person), limb, tuple(b.model for b in bodies),
                tuple(b.values.tobytes() for b in bodies),
                tuple(None if b.velocity is None else b.velocity.tobytes() for b in bodies),
                colors, is_blurred, ObjectIdentity(self._controller.session.cameras),
            )
        )  # fmt: skip

    def close(self) -> None:
        """Release the footage."""
        self._footage.close()

    def _draw(self, wanted: _Wanted) -> bytes | None:
        bodies = [
            PosedBody(m, np.frombuffer(v), None if moving is None else np.frombuffer(moving))
            for m, v, moving in zip(wanted.bodies, wanted.poses, wanted.velocities, strict=True)
        ]
        self._give_way()
        self._follow_cameras()
        cameras = self._footage.cameras
        crop = thumbnails.choose_crop(bodies, wanted.person, wanted.limb, cameras)
        if crop is None:
            return None
        image = self._footage.image(crop.camera, wanted.frame)
        self._give_way()
        limb = thumbnails.limb_parts(bodies, wanted.person, wanted.limb)
        then = ahead(bodies, self._cameras[crop.camera].clock.offset_frames(wanted.frame))
        if wanted.is_blurred and image is not None:
            image = blurred(image, circles_around(head_surfaces(then), cameras[crop.camera]))
        return thumbnails.thumbnail(image, cameras[crop.camera], crop.region, then, wanted.colors, limb)

    def _follow_cameras(self) -> None:
        """Draw with the cameras of the session, which a correction or undo may have exchanged."""
        cameras = self._controller.session.cameras
        if cameras is not self._cameras:
            self._cameras = cameras
            self._footage.set_cameras(cameras)

    def _give_way(self) -> None:
        """Wait while pictures of the shown frame are made or a pose is dragged, for a second at most."""
        end = time.monotonic() + _MAX_PAUSE_S
        while time.monotonic() < end and (
            self._controller.frames.is_making_pictures or self._controller.state.is_dragging
        ):
            time.sleep(_PAUSE_S)


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
